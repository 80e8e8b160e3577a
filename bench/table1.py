"""The paper's Table 1: regions of the Stanford Dragon by triangles, before halving, with and without the size penalty C(N).

python -m bench.table1: writes bench/results/table1.json and docs/table1.md.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import gltf_ext
from bench.common import MODELS, ROOT, markdown_table, origin, origin_line, write_result

# The default aims at regions nearly full, so that the penalty has work to do; 0.68 gives about the paper's number of regions.
FILLS = (None, 0.68)
WEIGHTS = {"paper": "equation (1) with C(N)", "choe": "without C(N), as Choe et al."}
CLAIMED = {"paper": (1276, 18474, 216, 23), "choe": (1285, 18435, 232, 38)}


def measure(model: Path, weight: str, fill: float | None) -> dict:
    """The histogram, and what the file made from these regions comes to."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "out.glb"
        report = gltf_ext.compress(model, output, weight=weight, fill=fill)
        totals = gltf_ext.inspect(output)["totals"]
    return {
        "weight": weight,
        "fill": fill,
        **report["generation"],
        "meshlets": totals["meshlets"],
        "ratio": totals["ratio"],
    }


def report(result: dict) -> str:
    """docs/table1.md."""
    rows = [
        [f"the paper's, {WEIGHTS[weight]}", *map(str, bins), "", ""]
        for weight, bins in CLAIMED.items()
    ]
    for row in result["rows"]:
        fill = "default fill" if row["fill"] is None else f"fill {row['fill']}"
        rows.append(
            [
                f"ours, {WEIGHTS[row['weight']]}, {fill}",
                *map(str, row["histogram"]),
                str(row["meshlets"]),
                f"{row['ratio']:.2f}",
            ]
        )
    return f"""# Meshlets by number of triangles, before halving

{origin_line(result)}
The Stanford Dragon of 871,306 triangles, as in Table 1 of [the paper](../README.md#the-paper); Choe et al. are named there too.
Fill is the region size that the initial centres are spread for, as a share of 64. The last two columns are
for the finished file, after refinement, halving and packing.

{markdown_table(["weight", "[0, 32)", "[32, 64)", "[64, 72)", "72 and more", "meshlets", "ratio"], rows)}"""


def main() -> None:
    model = MODELS / "dragon.glb"
    if not model.exists():
        raise SystemExit("bench: no dragon.glb; set GLTF_MESHLET_MODELS to a folder of models")
    rows = [measure(model, weight, fill) for fill in FILLS for weight in WEIGHTS]
    result = {**origin("bench.table1"), "claimed": CLAIMED, "rows": rows}
    write_result("table1", result)
    (ROOT / "docs" / "table1.md").write_text(report(result))


if __name__ == "__main__":
    main()
