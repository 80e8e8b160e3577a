"""How fast? Compression against size, and decoding against Draco, in one run on one machine.

python -m bench.speed: writes bench/results/speed.json and docs/speed.md. GLTF_MESHLET_MAKE_BIG names the script that
subdivides a model (IN.glb OUT.glb LEVELS -n); without it the growth is not measured.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import DracoPy
import numpy as np

import gltf_ext
from bench import native_build
from bench.common import MODELS, ROOT, markdown_table, origin, origin_line, write_result
from gltf_ext import _codec
from gltf_ext.extension import require_compressed
from gltf_ext.importers import open_model

MAKE_BIG = Path(os.environ.get("GLTF_MESHLET_MAKE_BIG", ROOT.parent / "shared" / "make_big.py"))
REPETITIONS = 5
DRACO_LEVEL = 7


def main() -> None:
    dragon = MODELS / "dragon.glb"
    if not dragon.exists():
        raise SystemExit("bench: dragon.glb not found; set GLTF_MESHLET_MODELS to the folder that holds it")
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        inputs = [dragon]
        if MAKE_BIG.exists():
            inputs.append(scratch / "dragon_subdivided.glb")
            subprocess.run([sys.executable, MAKE_BIG, dragon, inputs[-1], "1", "-n"], check=True, stdout=subprocess.DEVNULL)
        result = {**origin("bench.speed", ("gltf-meshlet", "numpy", "DracoPy")), "repetitions": REPETITIONS,
                  "compress": _compressions(inputs, scratch),
                  "decode": [_decoding(MODELS / f"{name}.glb", scratch) for name in ("bunny", "dragon")]}
    write_result("speed", result)
    text = report(result)
    (ROOT / "docs" / "speed.md").write_text(text)
    print(text)


def _compressions(paths: list[Path], scratch: Path) -> list[dict]:
    """The command as a user runs it: wall time and peak memory of the whole process; the models take turns."""
    runs = [[_compress(path, scratch) for path in paths] for _ in range(REPETITIONS)]
    rows = []
    for path, of_model in zip(paths, zip(*runs)):
        seconds, peak, triangles = (list(values) for values in zip(*of_model))
        rows.append({"model": path.stem, "triangles": triangles[0], "seconds": _spread(seconds),
                     "triangles_per_second": triangles[0] / statistics.median(seconds),
                     "peak_bytes": max(peak), "peak_bytes_per_triangle": max(peak) / triangles[0],
                     "times_first": _spread([run[0] / first[0] for run, (first, *_) in zip(of_model, runs)])})
    return rows


def _compress(path: Path, scratch: Path) -> tuple[float, int, int]:
    """(seconds, peak bytes, triangles) of one run."""
    command = [Path(sys.executable).with_name("gltf-meshlet"), "compress", path, scratch / "out.glb"]
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    if status != 0:
        raise SystemExit(f"bench: compress {path.name} failed")
    return seconds, usage.ru_maxrss * 1024, gltf_ext.inspect(scratch / "out.glb")["totals"]["triangles"]


def _decoding(path: Path, scratch: Path) -> dict:
    """One thread, all attributes, to float arrays; ours and Draco's turns alternate."""
    gltf_ext.compress(path, scratch / "out.glb")
    primitives = gltf_ext.load(scratch / "out.glb")
    blobs = [compressed.blob for compressed in require_compressed(open_model(scratch / "out.glb"))]
    draco = [_draco_encode(primitive) for primitive in primitives]
    triangles = sum(len(primitive.indices) for primitive in primitives)
    ours, theirs = [], []
    for _ in range(REPETITIONS):
        ours.append(_timed(_codec.decode_values, blobs))
        theirs.append(_timed(DracoPy.decode, draco))
    native = _native(blobs, scratch)
    return {"model": path.stem, "triangles": triangles, "native_seconds": _spread(native["decode_seconds"]),
            "python_seconds": _spread(ours), "draco_seconds": _spread(theirs),
            "one_meshlet_microseconds": _spread(native["meshlet_microseconds"])}


def _draco_encode(primitive) -> bytes:
    position, normals, texcoords = (
        primitive.attributes[name].astype(np.float64) if name in primitive.attributes else None
        for name in ("POSITION", "NORMAL", "TEXCOORD_0"))
    return DracoPy.encode(position, primitive.indices, compression_level=DRACO_LEVEL, quantization_bits=12,
                          normals=normals, normal_quantization_bits=8, tex_coord=texcoords, tex_coord_quantization_bits=12)


def _timed(decode, buffers) -> float:
    start = time.perf_counter()
    for buffer in buffers:
        decode(buffer)
    return time.perf_counter() - start


def _native(blobs: list[bytes], scratch: Path) -> dict:
    """bench/native/decode_speed on the blobs."""
    files = [scratch / f"{number}.blob" for number in range(len(blobs))]
    for file, blob in zip(files, blobs):
        file.write_bytes(blob)
    return json.loads(subprocess.run([native_build.build("MESHLET_BENCH") / "decode_speed", *files], check=True, capture_output=True).stdout)


def _spread(numbers: list[float]) -> dict:
    return {"median": statistics.median(numbers), "min": min(numbers), "max": max(numbers)}


def report(result: dict) -> str:
    """docs/speed.md."""
    compress = markdown_table(
        ["model", "triangles", "seconds (min to max)", "times the first", "million triangles per second", "peak memory",
         "bytes per triangle"],
        [[row["model"], f"{row['triangles']:,}", _range(row["seconds"], ".2f"), _range(row["times_first"], ".2f"),
          f"{row['triangles_per_second'] / 1e6:.2f}", f"{row['peak_bytes'] / 1e6:.0f} MB",
          f"{row['peak_bytes_per_triangle']:.0f}"] for row in result["compress"]])
    decode = markdown_table(
        ["model", "triangles", "native", "from Python", "DracoPy", "times DracoPy, native", "from Python",
         "one meshlet by number, microseconds"],
        [[row["model"], f"{row['triangles']:,}", *(_rate(row, key) for key in ("native_seconds", "python_seconds", "draco_seconds")),
          *(f"{row['draco_seconds']['median'] / row[key]['median']:.1f}" for key in ("native_seconds", "python_seconds")),
          _range(row["one_meshlet_microseconds"], ".2f")] for row in result["decode"]])
    return f"""# Speed

{origin_line(result)}
Medians of {result['repetitions']} runs.

## compress, as a whole process

{compress}
## Decoding on one thread, to float arrays, all attributes

Million triangles per second. Native: the C++ call, into memory allocated before. From Python and DracoPy
({result['versions']['DracoPy']}, level {DRACO_LEVEL}, the same bits): the Python calls, timed in turn. One meshlet by number: mean over all
meshlets in random order, the C++ call.

{decode}"""


def _rate(row: dict, key: str) -> str:
    return f"{row['triangles'] / row[key]['median'] / 1e6:.1f}"


def _range(spread: dict, form: str) -> str:
    return f"{spread['median']:{form}} ({spread['min']:{form}} to {spread['max']:{form}})"


if __name__ == "__main__":
    main()
