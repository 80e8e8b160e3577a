"""`gltf-meshlet demo`: compresses, decompresses and verifies a generated model; draws pictures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import gltf_ext
from gltf_ext.errors import printable
from gltf_meshlet.demo import model as demo_model
from gltf_meshlet.report_text import compress_summary, inspect_table, verify_text

RENDERED = (512, 384, 36)  # width, height, samples per pixel
MESHLETS_RENDERED = (640, 480, 64)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Adds the arguments of `demo`."""
    command.add_argument(
        "output",
        metavar="FOLDER",
        nargs="?",
        default="demo-output",
        help="where to save (default %(default)s)",
    )


def run(options: argparse.Namespace) -> int:
    """Runs the demo, writes into a folder (created if missing) and prints its reports.

    Returns the exit status. Raises MeshletError, OSError.
    """
    folder = Path(options.output)
    folder.mkdir(parents=True, exist_ok=True)
    models = [folder / f"{name}.glb" for name in ("original", "compressed", "decompressed")]
    original, compressed, decompressed = models
    demo_model.write_glb(demo_model.generate(), original)
    print(compress_summary(gltf_ext.compress(original, compressed)))
    gltf_ext.decompress(compressed, decompressed)
    inspected = gltf_ext.inspect(compressed)
    print(inspect_table(inspected, all_primitives=True))
    verified = gltf_ext.verify(original, compressed)
    print(f"verified: {verify_text(verified)}")
    pictures = _save_pictures(folder, original, compressed, inspected["totals"])
    names = ", ".join(path.name for path in [*models, *pictures])
    print(f"\nsaved in {printable(str(folder))}: {names}")
    return 0 if verified["ok"] else 1


def _save_pictures(
    folder: Path, original: Path, compressed: Path, totals: dict[str, Any]
) -> list[Path]:
    """Saves pictures by Mitsuba, if it is there; returns their paths."""
    try:
        from gltf_meshlet.demo import studio
    except ImportError as error:
        print(f"no pictures: {error}")
        return []
    print("rendering with Mitsuba (a minute)", flush=True)
    comparison, meshlets = folder / "render_comparison.png", folder / "meshlets.png"
    raw, small = (f"{totals[name] / 1e6:.2f} MB" for name in ("raw_bytes", "compressed_bytes"))
    captions = {
        f"original, {raw}": original,
        f"compressed, {small}, decoded where rays meet it": compressed,
    }
    studio.save_side_by_side(
        comparison,
        {text: studio.picture(path, *RENDERED) for text, path in captions.items()},
        [original, compressed],
    )
    studio.save(meshlets, studio.meshlets_picture(compressed, *MESHLETS_RENDERED), [compressed])
    return [comparison, meshlets]
