"""Images: checked for their size, or moved into views as they are."""

from __future__ import annotations

import io
import struct
import warnings

from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.lfs import PROBLEM, REMEDY, is_pointer
from gltf_ext.errors import MeshletError

MIME_TYPES = (
    (b"\x89PNG", "image/png"),
    (b"\xff\xd8\xff", "image/jpeg"),
    (b"RIFF", "image/webp"),
    (b"\xabKTX 20", "image/ktx2"),
    (b"DDS ", "image/vnd-ms.dds"),
)
FORMATS = ("PNG", "JPEG", "WEBP", "DDS", "BMP", "GIF", "TIFF")  # Pillow's names
# An image may take so much memory, as 8-bit RGBA: 4096 x 4096 pixels, and more if it has the bytes.
LEAST_DECODED = 64 << 20
JPEG_END, MOST_AFTER_JPEG = b"\xff\xd9", 1 << 16  # some writers append bytes
DECODED_PER_BYTE = 40


def check_size(data: bytes) -> None:
    """Refuse an image whose header claims far more pixels than its bytes can hold.

    Raises MeshletError, also for an unknown format.
    """
    if is_pointer(data):
        raise MeshletError(f"it is {PROBLEM}", REMEDY)
    width, height = size_of_image(data)
    if 4 * width * height > LEAST_DECODED + DECODED_PER_BYTE * len(data):
        raise MeshletError(f"it has too many pixels for its {len(data)} bytes")


def size_of_image(data: bytes | memoryview) -> tuple[int, int]:
    """Return (width, height) in pixels, as the header of an image claims.

    Raises MeshletError, also for an unknown format.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                width, height = image.size
                return width, height
    except Image.DecompressionBombError:
        return 2**31, 2**31
    except Exception:  # Pillow's readers raise anything
        raise MeshletError("it cannot be read") from None


def size_in_header(data: bytes | memoryview) -> tuple[int, int]:
    """Return (width, height) of a PNG, JPEG, WebP, KTX2 or DDS, without Pillow.

    Blender's Python, which compresses too, has none. Raises MeshletError.
    """
    start = bytes(data[:32])
    kind = mime_type(start)
    try:
        if kind == "image/png":
            return struct.unpack_from(">II", start, 16)
        if kind == "image/jpeg":
            return _size_of_jpeg(memoryview(data))
        if kind == "image/webp":
            return _size_of_webp(start)
        if kind == "image/ktx2":
            return struct.unpack_from("<II", start, 20)
        if kind == "image/vnd-ms.dds":
            height, width = struct.unpack_from("<II", start, 12)
            return width, height
    except (struct.error, IndexError):
        raise MeshletError("it is damaged or cut off") from None
    raise MeshletError("it cannot be read")


def _size_of_jpeg(data: memoryview) -> tuple[int, int]:
    """Look for the header of the frame. Raises struct.error, IndexError."""
    position = 2
    while True:
        while data[position] == 0xFF:  # may be repeated
            position += 1
        marker = data[position]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">HH", data, position + 4)
            return width, height
        (length,) = struct.unpack_from(">H", data, position + 1)
        position += 1 + max(length, 2)


def _size_of_webp(start: bytes) -> tuple[int, int]:
    """Read the first chunk of its three kinds. Raises struct.error, IndexError."""
    kind = start[12:16]
    if kind == b"VP8X":
        sides = int.from_bytes(start[24:27], "little"), int.from_bytes(start[27:30], "little")
        return sides[0] + 1, sides[1] + 1
    if kind == b"VP8L":
        (bits,) = struct.unpack_from("<I", start, 21)
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    width, height = struct.unpack_from("<HH", start, 26)
    return width & 0x3FFF, height & 0x3FFF


def mime_type(data: bytes) -> str | None:
    """Of an encoded image; None if glTF has none for it."""
    return next((mime for start, mime in MIME_TYPES if data.startswith(start)), None)


def as_png_or_jpeg(data: bytes) -> bytes:
    """Return the image itself if it is one of these, else the same pixels as a PNG.

    Raises MeshletError when it cannot be read or takes too much memory.
    """
    check_size(data)
    if mime_type(data) in ("image/png", "image/jpeg"):
        _require_end(data)
        return data
    from PIL import Image

    png = io.BytesIO()
    with Image.open(io.BytesIO(data), formats=FORMATS) as image:
        image.convert("RGBA").save(png, "PNG")
    return png.getvalue()


def _require_end(data: bytes) -> None:
    """Raise MeshletError for a PNG or JPEG that is cut off. Decodes no pixels."""
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as image:
            image.verify()  # checks the chunks of a PNG, and nothing of a JPEG
    except Exception:  # Pillow's readers raise anything
        raise MeshletError("it is damaged or cut off") from None
    if mime_type(data) == "image/jpeg" and JPEG_END not in data[-MOST_AFTER_JPEG:]:
        raise MeshletError("it is cut off")


def embed_images(document: Document, also_files: bool = True) -> list[str]:
    """Move images behind data: uris and, with also_files, relative paths into buffer views.

    Returns a warning for each image that should move and stays where it is.
    """
    problems = []
    replacements: dict[str, gltf.Image] = {}  # uri -> what replaces it
    for number, image in enumerate(document.images):
        uri = image.get("uri")
        if uri is None or not (also_files or uri.startswith("data:")):
            continue
        if uri in replacements:
            image.update(replacements[uri])
            del image["uri"]
            continue
        try:
            data = document.read_uri(uri)
        except MeshletError as error:
            problems.append(f"image {number} is not embedded: it {error}")
            continue
        mime = image.get("mimeType") or mime_type(data)
        if mime is None or not data:
            short = MeshletError(uri[:80]).message
            problems.append(f"image {number} is not embedded: {short} has an unknown format")
            continue
        replacements[uri] = {"bufferView": document.add_view(data), "mimeType": mime}
        image.update(replacements[uri])
        del image["uri"]
    return problems
