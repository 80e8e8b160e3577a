"""Builds a page of models for any static host: python -m tools.build_gallery FOLDER MODEL.glb...

The page shows the models, compressed with levels of detail, in elements <meshlet-view> of the npm
package. Any server of files will do; those that answer range requests let it stream.
"""

from __future__ import annotations

import argparse
import html
import subprocess
from pathlib import Path
from urllib.parse import quote

import gltf_ext
from gltf_ext.lod.simplifier import has_simplifier

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "web" / "gallery"
MODULES = ROOT / "build" / "node" / "node_modules"
PLACE = "<!-- models -->"
FIGURE = """
<figure>
<meshlet-view src="{address}" alt="{title}"></meshlet-view>
<figcaption>{title}: {triangles:,} triangles, {kilobytes:,.0f} kB</figcaption>
</figure>"""


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Build the gallery.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("models", type=Path, nargs="+", metavar="MODEL.glb")
    options = parser.parse_args(arguments)
    build(options.folder, options.models)


def build(folder: Path, models: list[Path]) -> None:
    """Write the page, its scripts and its models."""
    subprocess.run(["node", SOURCES / "build.mjs", MODULES, folder], check=True)
    figures = "".join(figure(model, folder) for model in models)
    page = (SOURCES / "index.html").read_text()
    (folder / "index.html").write_text(page.replace(PLACE, figures))


def figure(model: Path, folder: Path) -> str:
    """Write a model. Return what the page has for it."""
    output = folder / f"{model.stem}.glb"
    gltf_ext.compress(model, output, lod=has_simplifier())
    return FIGURE.format(
        address=f"./{quote(output.name)}",
        title=html.escape(model.stem.capitalize()),
        triangles=gltf_ext.inspect(output)["totals"]["triangles"],
        kilobytes=output.stat().st_size / 1000,
    )


if __name__ == "__main__":
    main()
