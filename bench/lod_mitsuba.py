"""Mitsuba with levels of detail beside full detail: time and memory. For bench.lod.

Each row runs in a process of its own. Memory is the growth of the process from before the scene is
loaded to after it was rendered, as in bench.mitsuba.
"""

from __future__ import annotations

import time

from bench.common import ROOT, call_in_process, progress

VARIANT = "scalar_rgb"
SIZE = 1000  # width and height of the picture in pixels; the model fills 85 %
SPP = 4
INTEGRATOR = {"type": "path", "max_depth": 3}
PIXELS = 1.0
WARM_UP = ROOT / "spec" / "lod_vectors" / "lod_strip.glb"
# (heading, lod_error, ordinary meshes)
ROWS = (
    ("mesh, full detail", 0.0, True),
    ("shape, full detail", 0.0, False),
    ("mesh, one pixel", PIXELS, True),
    ("shape, one pixel", PIXELS, False),
)


def measure(path: str) -> list[dict]:
    """A row for each of ROWS, for a file with levels."""
    rows = []
    for heading, lod_error, decoded in ROWS:
        progress(f"Mitsuba: {heading}")
        found = call_in_process("bench.lod_mitsuba", "render", path, lod_error, decoded)
        rows.append({"heading": heading, **found})
    return rows


def render(path: str, lod_error: float, decoded: bool) -> dict:
    """Seconds to load and render, bytes that stay, triangles of the scene."""
    import mitsuba as mi

    mi.set_variant(VARIANT)
    import mitsuba_plugin
    from bench.mitsuba import resident_bytes

    options = {"width": SIZE, "height": SIZE, "integrator": INTEGRATOR}
    # What Mitsuba keeps after its first picture does not count for the scene.
    mi.render(mitsuba_plugin.load_scene(str(WARM_UP), **options), spp=1).numpy()
    before, start = resident_bytes(), time.perf_counter()
    scene = mitsuba_plugin.load_scene(path, lod_error=lod_error, decoded=decoded, **options)
    loaded = time.perf_counter()
    mi.render(scene, spp=SPP, seed=0).numpy()
    rendered = time.perf_counter()
    after = resident_bytes()
    figures = mitsuba_plugin.statistics(scene)
    meshes = sum(shape.face_count() for shape in scene.shapes() if shape.is_mesh())
    return {
        "load": loaded - start,
        "render": rendered - loaded,
        "bytes": after - before,
        "triangles": meshes + figures["triangles"],
        "compressed_bytes": figures["compressed_bytes"],
        "cache_bytes": figures["resident_bytes"],
    }
