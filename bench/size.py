"""How small? Every model at 12/8/12 bits with the default options.

python -m bench.size: writes bench/results/size.json, docs/size.md and the table in README.md.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import gltf_ext
from bench.common import ROOT, markdown_table, models, origin, origin_line, replace_block, write_result

OPTIONS = {"position_bits": 12, "normal_bits": 8, "texcoord_bits": 12}
REPETITIONS = 3
PARTS = {"connectivity": "connectivity", "references_and_headers": "references", "positions": "positions",
         "normals": "normals", "texcoords": "uv", "other": "other", "total": "all"}


def measure(path: Path) -> dict:
    """inspect's totals for one model, with the seconds that compress took at its fastest (reading and writing included)."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "out.glb"
        seconds = []
        for _ in range(REPETITIONS):
            start = time.perf_counter()
            gltf_ext.compress(path, output, **OPTIONS)
            seconds.append(time.perf_counter() - start)
        return {"model": path.stem, "seconds": round(min(seconds), 3), **gltf_ext.inspect(output)["totals"]}


def table(rows: list[dict]) -> str:
    headings = ["model", "triangles", "vertices", "raw bytes", "compressed", "ratio", "triangles per meshlet",
                *PARTS.values(), "seconds"]
    return markdown_table(headings, [[
        row["model"], f"{row['triangles']:,}", f"{row['vertices']:,}", f"{row['raw_bytes']:,}",
        f"{row['compressed_bytes']:,}", f"**{row['ratio']:.2f}**", f"{row['mean_triangles_per_meshlet']:.1f}",
        *(f"{row['bits_per_triangle'][part]:.2f}" for part in PARTS), f"{row['seconds']:.2f}"] for row in rows])


def summary(rows: list[dict]) -> str:
    return markdown_table(
        ["model", "triangles", "raw", "compressed", "ratio", "bits per triangle"],
        [[row["model"], f"{row['triangles']:,}", f"{row['raw_bytes'] / 1e6:.2f} MB",
          f"{row['compressed_bytes'] / 1e6:.2f} MB", f"{row['ratio']:.2f}", f"{row['bits_per_triangle']['total']:.1f}"]
         for row in rows])


def report(result: dict) -> str:
    """docs/size.md."""
    return f"""# Compressed size

{origin_line(result)}
Positions 12, normals 8 + 8, texture coordinates 12 bits. Raw: source vertices after welding identical ones, 4 bytes per
float component and integers at their stored size, plus 12 bytes per triangle. Compressed: all bytes of the extension.
The columns from connectivity to all are bits per triangle; seconds are for `gltf_ext.compress`, files read and written,
the fastest of {REPETITIONS} runs.

{table(result["models"])}"""


def readme_block(result: dict) -> str:
    return f"{summary(result['models'])}\n{origin_line(result)}"


def main() -> None:
    result = {**origin("bench.size"), "options": OPTIONS, "models": []}
    for path in models():
        result["models"].append(measure(path))
        print(f"{path.stem}: {result['models'][-1]['ratio']:.2f}", flush=True)
    write_result("size", result)
    (ROOT / "docs" / "size.md").write_text(report(result))
    replace_block(ROOT / "README.md", "size", readme_block(result))
    print(table(result["models"]))


if __name__ == "__main__":
    main()
