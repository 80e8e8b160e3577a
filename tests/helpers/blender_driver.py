"""Runs inside Blender: imports, exports and compares glTF files for the tests.

Usage: BPY_PYTHON tests/helpers/blender_driver.py EXTENSION.zip FILE_DESCRIPTOR
Installs the extension, then reads lines, each a JSON array [function, arguments, options], and
writes a line with the function's result for each to the file descriptor; Blender prints to stdout.
The parent sets BLENDER_USER_RESOURCES to an empty folder.
"""

from __future__ import annotations

import json
import os
import sys
from types import SimpleNamespace
from unittest import mock

import bpy
import numpy as np
from mathutils.kdtree import KDTree

MODULE = "bl_ext.user_default.gltf_meshlet"
SAMPLED_POINTS = 5000  # a look-up takes 10 us
# Where foreach_get finds the values of an attribute, by its data type: name, components, dtype.
ATTRIBUTES = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "INT16_2D": ("value", 2, np.int32),
    "INT32_2D": ("value", 2, np.int32),
    "QUATERNION": ("value", 4, np.float32),
}


def install(path: str) -> None:
    """Installs and enables the extension."""
    bpy.ops.extensions.package_install_files(
        filepath=path, repo="user_default", enable_on_install=True
    )


def disable() -> None:
    """Turns the extension off."""
    bpy.ops.preferences.addon_disable(module=MODULE)


def panels() -> list:
    """The modules that Blender's exporter lets draw."""
    from io_scene_gltf2 import exporter_extension_layout_draw

    return list(exporter_extension_layout_draw)


def about() -> dict:
    """Whether Blender has Draco, and modules in use that the extension must not import."""
    from io_scene_gltf2 import is_draco_available

    unwanted = [name for name in ("PIL", "trimesh", "tqdm") if name in sys.modules]
    return {"draco": is_draco_available(), "unwanted": unwanted}


def import_file(path: str) -> str:
    """Imports a file into an empty scene; returns the error, or nothing."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    try:
        bpy.ops.import_scene.gltf(filepath=path)
    except RuntimeError as error:
        return str(error).strip()
    return ""


def import_with_failing_library(path: str, failure: str) -> str:
    """As import_file, while gltf_ext cannot be imported, or fails as no reader of files should."""

    def fail(path):
        raise RuntimeError("unexpected\nfailure")

    library = SimpleNamespace(load=fail) if failure == "bug" else None
    with mock.patch.dict(sys.modules, {"gltf_ext": library}):
        return import_file(path)


def contents() -> dict:
    """Counts of what is in the open file."""
    kinds = ("objects", "meshes", "materials", "images", "armatures", "actions")
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def compare(first: str, second: str) -> dict:
    """Imports both files; returns the errors, the differences and the contents of the second."""
    errors = [import_file(first)]
    expected = snapshot()
    errors.append(import_file(second))
    found = snapshot()
    names = sorted(expected.keys() | found.keys())
    differences = [name for name in names if not same(expected.get(name), found.get(name))]
    return {"errors": errors, "differences": differences, "contents": contents()}


def compare_shapes(first: str, second: str) -> dict:
    """Imports both files, of which the second is quantised.

    Returns the errors, the differences apart from the meshes' vertices, and mesh -> the largest
    distance of a vertex to the other file's mesh, as a share of the longest side.
    """
    errors = [import_file(first)]
    expected, expected_points = coarse_snapshot(), points_of_meshes()
    errors.append(import_file(second))
    found, found_points = coarse_snapshot(), points_of_meshes()
    names = sorted(expected.keys() | found.keys())
    differences = [name for name in names if not same(expected.get(name), found.get(name))]
    distances = {
        name: distance(points, found_points[name])
        for name, points in expected_points.items()
        if name in found_points and len(points) and len(found_points[name])
    }
    return {"errors": errors, "differences": differences, "distances": distances}


def export(path: str, folder: str, **options) -> dict:
    """Imports a file and exports it plain and compressed; returns errors, paths, and the result."""
    error = import_file(path)
    if error:
        return {"error": error}
    plain, compressed = f"{folder}/plain.glb", f"{folder}/compressed.glb"
    bpy.ops.export_scene.gltf(filepath=plain, export_format="GLB")
    import_file(path)  # the export of animations changes the open file
    return {
        "error": "",
        "plain": plain,
        "compressed": compressed,
        "result": export_open(compressed, **options),
    }


def export_open(path: str, export_format: str = "GLB", draco: bool = False, **options) -> list:
    """Exports the open file with compression; returns the error or what the panel shows."""
    settings = bpy.context.scene.gltf_meshlet
    settings.enabled = True
    for name, value in options.items():
        setattr(settings, name, value)
    try:
        bpy.ops.export_scene.gltf(
            filepath=path, export_format=export_format, export_draco_mesh_compression_enable=draco
        )
    except RuntimeError as error:
        return [str(error).strip()]
    finally:
        settings.enabled = False
    return list(sys.modules[f"{MODULE}.exporter"].last_result)


def export_collection(path: str) -> list:
    """Exports a collection by its own exporter; returns what the panel shows."""
    collection = bpy.data.collections.new("sphere")
    bpy.context.scene.collection.children.link(collection)
    layers = bpy.context.view_layer
    layers.active_layer_collection = layers.layer_collection.children[collection.name]
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
    bpy.context.scene.gltf_meshlet.enabled = True
    with bpy.context.temp_override(collection=collection):
        bpy.ops.collection.exporter_add(name="IO_FH_gltf2")
        collection.exporters[0].export_properties.filepath = path
        bpy.ops.collection.exporter_export(index=0)
    return list(sys.modules[f"{MODULE}.exporter"].last_result)


def settings() -> dict:
    """Limits and defaults of the options in the panel."""
    properties = bpy.context.scene.gltf_meshlet.bl_rna.properties
    return {
        name: [properties[name].hard_min, properties[name].hard_max, properties[name].default]
        for name in properties.keys()  # noqa: SIM118 (a bpy_prop_collection)
        if name.endswith("_bits")
    }


# --- what an import made ---


def snapshot() -> dict:
    """Name -> value of everything that a glTF file sets in the open Blender file."""
    bpy.context.view_layer.update()
    values: dict = {}
    for item in bpy.data.objects:
        values[f"object {item.name}"] = describe_object(item)
    for mesh in bpy.data.meshes:
        for name, value in describe_mesh(mesh).items():
            values[f"mesh {mesh.name} {name}"] = value
    for material in bpy.data.materials:
        values[f"material {material.name}"] = describe_material(material)
    for image in bpy.data.images:
        values[f"image {image.name}"] = [list(image.size), image.colorspace_settings.name]
    for armature in bpy.data.armatures:
        values[f"armature {armature.name}"] = [
            [bone.name, [list(row) for row in bone.matrix_local]] for bone in armature.bones
        ]
    for action in bpy.data.actions:
        values[f"action {action.name}"] = list(action.frame_range)
    return values


def coarse_snapshot() -> dict:
    """As snapshot, but of each mesh only what compression keeps as it is."""
    values = {name: v for name, v in snapshot().items() if not name.startswith("mesh ")}
    for mesh in bpy.data.meshes:
        values[f"mesh {mesh.name} materials"] = [m.name if m else "" for m in mesh.materials]
        values[f"mesh {mesh.name} attributes"] = sorted(
            [a.name, a.domain, a.data_type] for a in mesh.attributes
        )
        keys = mesh.shape_keys.key_blocks if mesh.shape_keys else ()
        values[f"mesh {mesh.name} shape keys"] = [key.name for key in keys]
    return values


def points_of_meshes() -> dict:
    return {
        mesh.name: read(mesh.vertices, "co", 3, np.float32).reshape(-1, 3)
        for mesh in bpy.data.meshes
    }


def distance(first: np.ndarray, second: np.ndarray) -> float:
    """Largest distance of a vertex of either mesh to the other's; of a sample of large meshes."""
    extent = float(np.ptp(first, axis=0).max()) or 1.0
    return max(one_sided(first, second), one_sided(second, first)) / extent


def one_sided(first: np.ndarray, second: np.ndarray) -> float:
    tree = KDTree(len(second))
    for index, point in enumerate(second):
        tree.insert(point, index)
    tree.balance()
    step = max(len(first) // SAMPLED_POINTS, 1)
    return max(tree.find(point)[2] for point in first[::step])


def describe_object(item) -> list:
    return [
        item.type,
        item.parent.name if item.parent else "",
        [list(row) for row in item.matrix_world],
        item.data.name if item.data else "",
        [slot.material.name if slot.material else "" for slot in item.material_slots],
        [modifier.type for modifier in item.modifiers],
        [group.name for group in item.vertex_groups],
    ]


def describe_mesh(mesh) -> dict:
    values = {
        "materials": [material.name if material else "" for material in mesh.materials],
        "loops": read(mesh.loops, "vertex_index", 1, np.int32),
        "polygons": read(mesh.polygons, "loop_start", 1, np.int32),
        "normals": read(mesh.corner_normals, "vector", 3, np.float32),
        "groups": [[(g.group, g.weight) for g in vertex.groups] for vertex in mesh.vertices],
    }
    for attribute in mesh.attributes:
        name, components, dtype = ATTRIBUTES[attribute.data_type]
        values[f"attribute {attribute.name}"] = read(attribute.data, name, components, dtype)
    for key in mesh.shape_keys.key_blocks if mesh.shape_keys else ():
        values[f"shape key {key.name}"] = read(key.data, "co", 3, np.float32)
    return values


def read(items, name: str, components: int, dtype) -> np.ndarray:
    values = np.empty(len(items) * components, dtype)
    items.foreach_get(name, values)
    return values


def describe_material(material) -> list:
    nodes = material.node_tree.nodes if material.node_tree else ()
    return [
        [
            node.bl_idname,
            [str(plain_value(socket)) for socket in node.inputs],
            node.image.name if getattr(node, "image", None) else "",
        ]
        for node in nodes
    ]


def plain_value(socket):
    value = getattr(socket, "default_value", None)
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def same(first, second) -> bool:
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        exact = first.dtype.kind != "f"
        return np.array_equal(first, second, equal_nan=not exact)
    return repr(first) == repr(second)


FUNCTIONS = (
    about,
    compare,
    compare_shapes,
    contents,
    disable,
    export,
    export_collection,
    export_open,
    import_file,
    import_with_failing_library,
    panels,
    settings,
)


def main() -> None:
    install(sys.argv[1])
    functions = {function.__name__: function for function in FUNCTIONS}
    with os.fdopen(int(sys.argv[2]), "w") as answers:
        for line in sys.stdin:
            name, arguments, options = json.loads(line)
            print(json.dumps(functions[name](*arguments, **options)), file=answers, flush=True)


if __name__ == "__main__":
    main()
