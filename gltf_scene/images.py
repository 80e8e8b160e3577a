"""Images, decoded after a check of their size."""

from __future__ import annotations

import io
import warnings

import numpy as np

from gltf_ext.document.document import Document, item
from gltf_ext.document.images import FORMATS, check_size
from gltf_ext.errors import MeshletError


def read_image(document: Document, index: int) -> np.ndarray:
    """Return uint8[height, width, 4], sRGB and alpha, of an image whose size is plausible.

    Raises MeshletError.
    """
    from PIL import Image

    image = item(document.images, index, "image")
    if "uri" in image:
        data = document.read_uri(image["uri"])
    else:
        data = bytes(document.bytes_of_view(image.get("bufferView")))
    check_size(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data), formats=FORMATS) as picture:
                if picture.mode.startswith("I;16"):
                    high = (np.asarray(picture) >> 8).astype(np.uint8)
                    return np.asarray(Image.fromarray(high).convert("RGBA"))
                return np.asarray(picture.convert("RGBA"))
    except Exception:  # Pillow's readers raise anything
        raise MeshletError("it cannot be read") from None
