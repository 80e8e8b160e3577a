"""codec/c: bad arguments give a status, docs/c.md is right, Python agrees with the headers."""

from __future__ import annotations

import contextlib
import ctypes
import re
import shutil
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest

from gltf_ext import _codec, _library
from gltf_ext.lod import open_lod
from tests.helpers.environment import ROOT
from tests.helpers.native import program_of

HEADER = ROOT / "codec" / "c" / "gltf_meshlet.h"
INTERNAL = HEADER.with_name("gltf_meshlet_internal.h")
LIBRARY = Path(_library.library._name)
LEVELS = ROOT / "spec" / "lod_vectors" / "lod_levels.glb"
VECTOR = ROOT / "spec" / "vectors" / "valid_group_tables.bin"


# --- the manual's programs ---


def program_of_the_manual(language, compiler, marks, tmp_path):
    """Compiles the one program in a language that has these words."""
    if shutil.which(compiler[0]) is None:
        pytest.skip(f"{compiler[0]} is not installed")
    manual = (ROOT / "docs" / "c.md").read_text()
    blocks = re.findall(rf"^```{language}\n(.*?)^```", manual, re.M | re.S)
    (code,) = (block for block in blocks if "int main(" in block and marks in block)
    source, program = tmp_path / f"program.{language}", tmp_path / "program"
    source.write_text(code)
    flags = ["-Wall", "-Wextra", "-Werror", f"-I{HEADER.parent}", source]
    link = [f"-L{LIBRARY.parent}", "-lgltf_meshlet", f"-Wl,-rpath,{LIBRARY.parent}"]
    subprocess.run([*compiler, *flags, *link, "-o", program], check=True)
    return program


@pytest.mark.parametrize(
    ("language", "compiler", "printed"),
    [
        ("c", ["cc", "-std=c99", "-pedantic"], "128 triangles in "),
        ("cpp", ["c++", "-std=c++11", "-pthread"], " triangles in "),
    ],
)
def test_program_of_the_manual(language, compiler, printed, tmp_path):
    program = program_of_the_manual(language, compiler, "gltf_meshlet_get_counts(view", tmp_path)
    done = subprocess.run([program, VECTOR], check=True, capture_output=True, text=True, timeout=60)
    assert printed in done.stdout
    if language == "cpp":
        count = _codec.Decoder(VECTOR.read_bytes()).triangle_count
        assert done.stdout.startswith(f"{count} of {count} triangles")
        refused = subprocess.run([program], capture_output=True, text=True, timeout=60)
        assert (refused.returncode, refused.stderr) == (2, "give the name of a file to read\n")


def test_program_for_levels_of_the_manual(tmp_path):
    compiler = ["cc", "-std=c99", "-pedantic"]
    program = program_of_the_manual("c", compiler, "gltf_meshlet_make_cut", tmp_path)
    primitive = max(open_lod(LEVELS), key=lambda p: len(p.tables.groups))
    tables = primitive.tables
    pages = [primitive.page(p) for p in range(len(tables.pages))]
    coarse = tables.coarse_pages
    views = [tables.to_bytes(), b"".join(pages[:coarse]), b"".join(pages[coarse:])]
    files = [tmp_path / name for name in ("tables", "coarse", "fine")]
    for file, view in zip(files, views):
        file.write_bytes(view)
    counts = len(pages), coarse, len(tables.groups), len(tables.run_group), tables.root_pages
    done = subprocess.run(
        [program, *files, *map(str, counts)], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    drawn = [int(n) for n in re.findall(r": (\d+) triangles", done.stdout)]
    level_0 = int(tables.pages["triangles"][coarse:].sum())
    assert drawn[0] == 0 and sorted(drawn) == drawn and 0 < drawn[1] < drawn[-1] <= level_0


# --- Python's side ---


def test_python_has_the_constants_of_the_format():
    text = (ROOT / "codec" / "format" / "constants.h").read_text()
    names = [
        name
        for name in vars(_codec)
        if re.match("(KIND|PREDICT|GRID|OCT|STREAM|BLOB|MESHL)_", name)
    ]
    names += ["MESHLET_TRIANGLES", "MESHLET_VERTICES"]
    for name in names:
        (value,) = re.findall(rf"#define {name} (\d+)u", text)
        assert getattr(_codec, name) == int(value), name
    assert len(names) > 15


def test_python_declares_what_the_header_declares(tmp_path):
    """Functions' number of arguments, structs' sizes and offsets."""
    if shutil.which("cc") is None:
        pytest.skip("cc is not installed")
    text = HEADER.read_text() + INTERNAL.read_text()
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    declared = dict(re.findall(r"gltf_meshlet_(\w+)\(([^;]*)\);", text))
    for name, types in map(str.split, _library.FUNCTIONS.split(",")):
        assert len(declared[name].split(",")) == len(types), name
    expected, printed = [], []
    for name, body in re.findall(r"typedef struct (gltf_meshlet_\w+) \{(.*?)\n\}", text, re.S):
        kind = name.removeprefix("gltf_meshlet_").title().replace("_", "")
        names = {"Stream": "StreamRow", "Options": "MeshletOptions"}
        struct = getattr(_library, names.get(kind, kind), None)
        if struct is None:  # Python has no use for it
            continue
        fields = [getattr(struct, field) for field, _ in struct._fields_]
        expected += [ctypes.sizeof(struct), *(field.offset for field in fields)]
        body = re.sub(r"\(\*(\w+)\)\([^)]*\)", r"\1", body)
        printed.append(f"sizeof({name})")
        printed += [f"offsetof({name}, {f})" for f in re.findall(r"(\w+)(?:\[\w+\])?[,;]", body)]
    calls = "".join(f'printf("%d ", (int){value});' for value in printed)
    source = f"#include <stdio.h>\n#include <{INTERNAL.name}>\nint main(void) {{{calls}}}\n"
    program = tmp_path / "layout"
    command = ["cc", f"-I{HEADER.parent}", "-x", "c", "-", "-o", program]
    subprocess.run(command, input=source, text=True, check=True)
    done = subprocess.run([program], capture_output=True, text=True)
    assert len(printed) > 120
    assert list(map(int, done.stdout.split())) == expected


def test_what_the_progress_function_raises_cancels():
    class Enough(BaseException):
        pass

    def progress(fraction):
        raise Enough(str(fraction))

    triangles, positions = np.array([[0, 1, 2]], np.uint32), np.eye(3, dtype=np.float32)
    stream = _codec.Stream(_codec.KIND_INTEGER, 1, 1)
    values = [np.array([[0], [1], [0]], np.uint32)]
    with pytest.raises(Enough):
        _codec.encode(triangles, triangles[0], positions, [stream], values, progress=progress)


def test_calls_release_the_interpreter():
    """Python runs while another thread decodes, and is refused the same scratch."""
    decoder, numbers = _codec.Decoder(VECTOR.read_bytes()), np.zeros(200_000, np.uint32)
    none = _library.MeshletArrays()
    arguments = (decoder, decoder._scratch, numbers.ctypes, len(numbers), none)

    def decode_all():
        while True:
            with contextlib.suppress(ValueError):  # the other thread came first
                return _library.functions.decode_meshlets(*arguments)

    thread = threading.Thread(target=decode_all)
    thread.start()
    refused = 0
    while thread.is_alive():
        try:
            decoder.decode_meshlet(0)
        except ValueError as error:
            assert "another thread uses the scratch" in str(error)
            refused += 1
    assert refused


def test_threads_share_one_blob():
    """Ranges of a blob, more than one thread takes; with seams, whose vertices have copies."""
    side = 180
    grid = np.arange(side * side, dtype=np.uint32).reshape(side, side)
    a, b, c, d = (grid[y : y + side - 1, x : x + side - 1] for y in (0, 1) for x in (0, 1))
    triangles = np.stack([a, b, c, b, d, c], axis=-1).reshape(-1, 3)
    xyz = np.stack([grid % side, grid // side, grid * grid % 7], axis=-1).reshape(-1, 3)
    seam = (xyz[:, 0] == side // 2) & (xyz[:, 1] % 16 < 8)
    twin = np.where(seam, len(xyz) + np.cumsum(seam) - 1, np.arange(len(xyz))).astype(np.uint32)
    right = xyz[triangles].sum(axis=1)[:, 0] > 3 * (side // 2)
    triangles[right] = twin[triangles[right]]
    source = np.concatenate([np.arange(len(xyz)), np.flatnonzero(seam)]).astype(np.uint32)
    xyz = np.ascontiguousarray(xyz[source], np.uint32)
    streams = [_codec.Stream(_codec.KIND_GRID, 3, 8, 1.0), _codec.Stream(_codec.KIND_INTEGER, 1, 1)]
    values = [xyz, (np.arange(len(xyz)) >= side * side).astype(np.uint32)[:, None]]
    view, _ = _codec.encode(triangles, source, xyz.astype(np.float32), streams, values)
    assert _codec.Decoder(view).meshlet_count > 1000
    one = _codec.decode(view, 1)
    for threads in (2, 3, 16):
        many = _codec.decode(view, threads)
        for left, right in zip([one[0], *one[1]], [many[0], *many[1]]):
            np.testing.assert_array_equal(left, right)


def test_kept_arrays_hold_what_new_ones_do():
    decoder = _codec.Decoder(VECTOR.read_bytes())
    for m in range(decoder.meshlet_count):
        triangles, values = decoder.decode_meshlet(m)
        sizes = decoder.decode_kept(m)
        assert sizes == (len(triangles), len(values[0]))
        np.testing.assert_array_equal(decoder.buffers[0][: sizes[0]], triangles)
        for buffer, new in zip(decoder.buffers[1], values):
            np.testing.assert_array_equal(buffer[: sizes[1]], new)


# --- bad arguments ---


def test_bad_arguments_give_a_status():
    """Under ASan and UBSan."""
    program = program_of("MESHLET_FUZZ", "bad_arguments")
    view = VECTOR.parent / "valid_several_groups.bin"  # its meshlets share vertices
    done = subprocess.run([program, view], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def test_exports_link_without_meshoptimizer():
    """LLD, the linker of Zig, refuses exact names that nothing defines."""
    exports = (ROOT / "codec" / "c" / "exports.map").read_text()
    (names,) = re.findall("global: (.*);", exports)
    assert all(name.endswith("*") for name in names.split("; "))
