"""References for the Mitsuba plugin: Mitsuba's own triangle meshes of the decompressed file."""

from __future__ import annotations

import os
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import gltf_ext
from tests.helpers.environment import missing
from tests.helpers.gltf_builder import Builder, everything

VARIANTS = ("scalar_rgb", "llvm_ad_rgb", "scalar_spectral", "llvm_ad_spectral")


def require(variant: str) -> tuple[ModuleType, ModuleType]:
    """(mitsuba, mitsuba_plugin) with the variant set; reports them missing if they are."""
    try:
        import mitsuba as mi

        import mitsuba_plugin
    except ImportError as error:
        missing(f"Mitsuba cannot be used: {error}")
    if variant.startswith("llvm") and not llvm_found():
        missing(
            f"{variant} cannot run: there is no LLVM 17 or newer (Debian: apt install libllvm19)"
        )
    mi.set_variant(variant)
    return mi, mitsuba_plugin


def llvm_found() -> bool:
    """True if Dr.Jit finds an LLVM that it can use."""
    from mitsuba_plugin import llvm

    return llvm.choose()


def mesh_of(
    primitive: gltf_ext.Primitive,
    matrix: np.ndarray | None = None,
    normals: bool = True,
    properties: dict | None = None,
) -> Any:
    """A decoded primitive as a mi.Mesh; COLOR_0's first three components become vertex_color."""
    import mitsuba as mi

    attributes = primitive.attributes
    props = mi.Properties()
    for name, value in (properties or {}).items():
        props[name] = mi.load_dict(value) if isinstance(value, dict) else value
    has = {name: name in attributes for name in ("NORMAL", "TEXCOORD_0", "COLOR_0")}
    positions, directions = attributes["POSITION"].astype(np.float64), attributes.get("NORMAL")
    if matrix is not None:
        positions = positions @ matrix[:3, :3].T + matrix[:3, 3]
        if directions is not None:
            directions = directions.astype(np.float64) @ np.linalg.inv(matrix[:3, :3])
            directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    mesh = mi.Mesh(
        "reference",
        len(positions),
        len(primitive.indices),
        props,
        has_vertex_normals=has["NORMAL"] and normals,
        has_vertex_texcoords=has["TEXCOORD_0"],
    )
    parameters = mi.traverse(mesh)
    parameters["faces"] = primitive.indices.astype(np.uint32).ravel()
    parameters["vertex_positions"] = positions.astype(np.float32).ravel()
    if has["NORMAL"] and normals:
        parameters["vertex_normals"] = directions.astype(np.float32).ravel()
    if has["TEXCOORD_0"]:
        parameters["vertex_texcoords"] = attributes["TEXCOORD_0"].astype(np.float32).ravel()
    parameters.update()
    if has["COLOR_0"]:
        colors = attributes["COLOR_0"]
        scale = 1.0 if colors.dtype.kind == "f" else 1.0 / np.iinfo(colors.dtype).max
        mesh.add_attribute(
            "vertex_color", 3, (colors[:, :3] * np.float32(scale)).astype(np.float32).ravel()
        )
    return mesh


def compressed(source: Path, folder: Path) -> tuple[Path, list[gltf_ext.Primitive]]:
    """(compressed file, the primitives of its decompressed form)."""
    target, plain = folder / f"{source.stem}.compressed.glb", folder / f"{source.stem}.plain.glb"
    if not plain.exists():
        gltf_ext.compress(source, target)
        gltf_ext.decompress(target, plain)
    return target, gltf_ext.load(plain)


def shapes_of(path: Path, primitives: list[gltf_ext.Primitive], **options: Any) -> dict:
    """Scene entries: one compressed shape for each primitive."""
    return {
        f"shape_{i}": {
            "type": "meshlet_edgebreaker",
            "filename": os.fspath(path),
            "mesh": p.mesh,
            "primitive": p.primitive,
            **options,
        }
        for i, p in enumerate(primitives)
    }


def meshes_of(primitives: list[gltf_ext.Primitive], **options: Any) -> dict:
    """Scene entries: one of Mitsuba's own meshes for each primitive."""
    return {f"shape_{i}": mesh_of(p, **options) for i, p in enumerate(primitives)}


def scene(
    shapes: dict,
    integrator: dict,
    size: tuple[int, int] = (64, 64),
    spp: int = 1,
    view: tuple[float, float, float] = (0.3, 0.4, 1.0),
    light: bool = True,
):
    """A scene that shows all of the shapes."""
    import mitsuba as mi

    box = mi.load_dict({"type": "scene", **shapes}).bbox()
    center, extents = np.array(box.center()).ravel(), np.array(box.extents()).ravel()
    origin = center + np.array(view) * np.linalg.norm(extents)
    return mi.load_dict(
        {
            "type": "scene",
            **shapes,
            "integrator": integrator,
            **({"light": {"type": "constant"}} if light else {}),
            "sensor": {
                "type": "perspective",
                "fov": 45,
                "fov_axis": "larger",
                "to_world": mi.ScalarTransform4f().look_at(list(origin), list(center), [0, 1, 0]),
                "film": {
                    "type": "hdrfilm",
                    "width": size[0],
                    "height": size[1],
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                },
                "sampler": {"type": "independent", "sample_count": spp},
            },
        }
    )


AOVS = {
    "type": "aov",
    "aovs": "position:position,normal:sh_normal,geometric:geo_normal,uv:uv,du:dp_du,dv:dp_dv",
}


def picture(scene: Any, **options: Any) -> np.ndarray:
    """Renders a scene; float32[height, width, channels]."""
    import mitsuba as mi

    return np.array(mi.render(scene, **options))


def sheet(
    folder: Path,
    attributes: tuple[str, ...] = ("POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0"),
    name: str = "sheet",
) -> tuple[Path, list[gltf_ext.Primitive]]:
    """A compressed sheet and its decompressed primitives. Normals are those of the surface."""
    values, triangles, _ = everything(columns=40, rows=30)
    x, y = values["POSITION"][:, 0], values["POSITION"][:, 1]
    slope = np.stack(
        [-np.cos(5 * x) * np.cos(4 * y), 0.8 * np.sin(5 * x) * np.sin(4 * y), np.ones_like(x)],
        axis=1,
    )
    values["TEXCOORD_0"] = values["POSITION"][:, :2] * np.float32(0.5)
    values["NORMAL"] = (slope / np.linalg.norm(slope, axis=1, keepdims=True)).astype(np.float32)
    builder = Builder()
    builder.mesh({n: values[n] for n in attributes}, triangles)
    return compressed(builder.write(folder / f"{name}.glb"), folder)
