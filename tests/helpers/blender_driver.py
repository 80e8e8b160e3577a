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
import time
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar
from unittest import mock

import blender_scenes
import bpy
import numpy as np
from mathutils.kdtree import KDTree

MODULE = "bl_ext.user_default.gltf_meshlet"
NOT_EXPORTED = "glTF_not_exported"  # Blender's collection of shapes of bones
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


def about() -> dict:
    """Whether Blender has Draco, and modules in use that the extension must not import."""
    from io_scene_gltf2 import is_draco_available

    unwanted = [name for name in ("PIL", "trimesh", "tqdm") if name in sys.modules]
    return {"draco": is_draco_available(), "unwanted": unwanted}


def enable_without_preferences() -> None:
    """Enables it as scripts do that do not touch the preferences."""
    import addon_utils  # Blender's, there when bpy is

    disable()
    addon_utils.enable(MODULE)


def enable() -> None:
    """Enables it in the preferences."""
    bpy.ops.preferences.addon_enable(module=MODULE)


def import_file(path: str, **detail) -> str:
    """Imports a file into an empty scene; returns the error, or nothing.

    detail: arguments of the import, without the prefix.
    """
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    arguments = {f"import_meshlet_{name}": value for name, value in detail.items()}
    try:
        bpy.ops.import_scene.gltf(filepath=path, **arguments)
    except RuntimeError as error:
        return str(error).strip()
    return ""


def import_with_failing_library(path: str, failure: str) -> str:
    """As import_file, while gltf_ext cannot be imported, or fails as no reader of files should."""

    def fail(path, **detail):
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


def export_open(
    path: str, export_format: str = "GLB", draco: bool = False, enabled: bool = True, **options
) -> list:
    """Exports the open file with compression; returns the error or what the panel shows.

    options: arguments of the export, without the prefix.
    """
    arguments = {f"export_meshlet_{name}": value for name, value in options.items()}
    of_add_on = bpy.context.preferences.addons["io_scene_gltf2"].preferences
    of_add_on.allow_embedded_format = export_format == "GLTF_EMBEDDED"
    try:
        bpy.ops.export_scene.gltf(
            filepath=path,
            export_format=export_format,
            export_draco_mesh_compression_enable=draco,
            export_meshlet_enabled=enabled,
            **arguments,
        )
    except RuntimeError as error:
        return [str(error).strip()]
    return shown()


def export_by_scene(path: str, settings: dict, **arguments) -> list:
    """As export_open, by settings of the scene and arguments of the export."""
    for name, value in settings.items():
        setattr(bpy.context.scene.gltf_meshlet, name, value)
    bpy.ops.export_scene.gltf(filepath=path, **arguments)
    return shown()


def shown() -> list:
    """What the panel shows of the last export."""
    return list(sys.modules[f"{MODULE}.exporter"].last_result)


def export_collection(path: str, **options) -> list:
    """Exports a collection by its own exporter; returns what the panel shows.

    options: of the exporter, without the prefix; without any, those of the scene.
    """
    collection = bpy.data.collections.new("sphere")
    bpy.context.scene.collection.children.link(collection)
    layers = bpy.context.view_layer
    layers.active_layer_collection = layers.layer_collection.children[collection.name]
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
    bpy.context.scene.gltf_meshlet.enabled = not options
    with bpy.context.temp_override(collection=collection):
        bpy.ops.collection.exporter_add(name="IO_FH_gltf2")
        properties = collection.exporters[0].export_properties
        properties.filepath = path
        for name, value in options.items():
            setattr(properties, f"export_meshlet_{name}", value)
        bpy.ops.collection.exporter_export(index=0)
    return shown()


def settings() -> dict:
    """Limits and defaults of the options in the panel."""
    properties = bpy.ops.export_scene.gltf.get_rna_type().properties
    prefix = "export_meshlet_"
    return {
        name.removeprefix(prefix): [
            properties[name].hard_min,
            properties[name].hard_max,
            properties[name].default,
        ]
        for name in properties.keys()  # noqa: SIM118 (a bpy_prop_collection)
        if name.startswith(prefix) and name.endswith("_bits")
    }


def arguments_of(operator: str) -> list:
    """The names of the extension's arguments of an operator, "export" or "import"."""
    properties = getattr(bpy.ops, f"{operator}_scene").gltf.get_rna_type().properties
    return [name for name in properties.keys() if "meshlet" in name]  # noqa: SIM118


def remembered(path: str, **options) -> dict:
    """The extension's settings in the scene after an export with "Remember Export Settings"."""
    arguments = {f"export_meshlet_{name}": value for name, value in options.items()}
    bpy.ops.export_scene.gltf(filepath=path, will_save_settings=True, **arguments)
    stored = bpy.context.scene["glTF2ExportSettings"].to_dict()
    return {name: value for name, value in stored.items() if "meshlet" in name}


def in_presets() -> list:
    """The extension's arguments of the export that a preset of the dialog stores."""
    return [
        p.identifier
        for p in bpy.ops.export_scene.gltf.get_rna_type().properties
        if "meshlet" in p.identifier and not (p.is_hidden or p.is_skip_save)
    ]


# --- topology, modifiers, levels ---


def topology() -> dict:
    """Counts of all meshes: vertices, edges, triangles, islands, and edges of one triangle."""
    counts = dict.fromkeys(("vertices", "edges", "triangles", "islands", "boundary"), 0)
    for mesh in bpy.data.meshes:
        if mesh.users:
            for name, count in topology_of(mesh).items():
                counts[name] += count
    return counts


def topology_of(mesh) -> dict:
    edges = read(mesh.edges, "vertices", 2, np.int32).reshape(-1, 2)
    uses = np.bincount(read(mesh.loops, "edge_index", 1, np.int32), minlength=len(edges))
    labels = np.arange(len(mesh.vertices))
    while True:  # each vertex takes the least label around, then that label's
        before = labels.copy()
        for a, b in (edges.T, edges.T[::-1]):
            np.minimum.at(labels, a, labels[b])
        labels = labels[labels]
        if np.array_equal(labels, before):
            break
    return {
        "vertices": len(mesh.vertices),
        "edges": len(edges),
        "triangles": len(mesh.polygons),
        "islands": len(np.unique(labels)),
        "boundary": int((uses == 1).sum()),
    }


def modified(kind: str, **values) -> dict:
    """Topology and the longest side of what a modifier makes of each object's mesh."""
    for item in bpy.context.view_layer.objects:
        if item.type == "MESH":
            modifier = item.modifiers.new(kind, kind)
            for name, value in values.items():
                setattr(modifier, name, value)
    graph = bpy.context.evaluated_depsgraph_get()
    result = {}
    for item in bpy.context.view_layer.objects:
        if item.type == "MESH":
            mesh = item.evaluated_get(graph).to_mesh()
            points = read(mesh.vertices, "co", 3, np.float32).reshape(-1, 3)
            extent = np.ptp(points, axis=0) if len(points) else np.zeros(3)
            result[item.name] = {**topology_of(mesh), "size": extent.tolist()}
    return result


def objects() -> dict:
    """Object -> its triangles, those in the viewport, its collections and modifiers."""
    graph = bpy.context.evaluated_depsgraph_get()
    return {
        item.name: {
            "triangles": len(item.data.polygons),
            "shown": len(item.evaluated_get(graph).data.polygons),
            "collections": [collection.name for collection in item.users_collection],
            "hidden": not item.visible_get(),
            "modifiers": [modifier.name for modifier in item.modifiers],
        }
        for item in bpy.context.scene.collection.all_objects
        if item.type == "MESH" and NOT_EXPORTED not in [c.name for c in item.users_collection]
    }


class CountingEngine(bpy.types.RenderEngine):
    """Counts what it is given to render."""

    bl_idname, bl_label = "COUNTING", "Counting"
    triangles: ClassVar[dict] = {}

    def render(self, depsgraph):
        self.triangles.clear()
        for instance in depsgraph.object_instances:
            if instance.object.type == "MESH":
                mesh = instance.object.data
                self.triangles[instance.object.name] = len(mesh.polygons)


def rendered() -> dict:
    """Object -> its triangles in a render."""
    bpy.utils.register_class(CountingEngine)
    scene = bpy.context.scene
    scene.render.engine = "COUNTING"
    scene.render.resolution_x = scene.render.resolution_y = 8
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        scene.collection.objects.link(scene.camera)
    bpy.ops.render.render()
    bpy.utils.unregister_class(CountingEngine)
    return dict(CountingEngine.triangles)


def export_applied(path: str) -> None:
    """Exports what the viewport shows, with modifiers applied, and plain."""
    bpy.ops.export_scene.gltf(filepath=path, export_apply=True, export_meshlet_enabled=False)


def save_and_open(path: str) -> None:
    """Saves the open file as a .blend and opens that."""
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)


def import_messages(path: str, **detail) -> list:
    """What the extension reports when a file is imported."""
    hooks = []
    kind = sys.modules[f"{MODULE}.importer"].glTF2ImportUserExtension
    former = kind.__init__

    def init(self):
        former(self)
        hooks.append(self)

    with mock.patch.object(kind, "__init__", init):
        import_file(path, **detail)
    return [text for hook in hooks for _, text in hook.messages]


# --- exports that are refused, fail or are cancelled ---


def refusal(export_format: str, compression: str | None) -> str:
    """Why the panel refuses an export together with another compression."""
    exporter = sys.modules[f"{MODULE}.exporter"]
    values = dict.fromkeys(exporter.OTHERS.values(), False)
    if compression:
        values[exporter.OTHERS[compression]] = True
    return exporter.refusal(SimpleNamespace(export_format=export_format, **values))


def failing_export(path: str) -> None:
    """An export that fails in Blender's own code."""
    from io_scene_gltf2 import ExportGLTF2

    with mock.patch.object(ExportGLTF2, "check", side_effect=OSError), suppress(RuntimeError):
        bpy.ops.export_scene.gltf(filepath=path, export_meshlet_enabled=True)


def cancelled_job(path: str) -> list:
    """What a job shows at its start and after a second, and how it ends when it is cancelled."""
    bpy.ops.export_scene.gltf(filepath=path)
    exporter, jobs = (sys.modules[f"{MODULE}.{name}"] for name in ("exporter", "jobs"))

    def work(path, options, folder):
        while True:
            time.sleep(0.05)
            options["progress"](0.5)

    with mock.patch.object(exporter, "compress_in_place", work):
        job = exporter._start(Path(path), {})
        texts = [job.text]
        time.sleep(1.1)
        texts.append(job.text)
        job.cancel()
        while job.is_running(0.1):
            pass
    try:
        job.result()
    except jobs.Cancelled as error:
        return [texts, type(error).__name__]
    return [texts, ""]


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
    *blender_scenes.FUNCTIONS,
    about,
    arguments_of,
    cancelled_job,
    compare,
    compare_shapes,
    contents,
    disable,
    enable,
    enable_without_preferences,
    export,
    export_applied,
    export_by_scene,
    export_collection,
    export_open,
    failing_export,
    import_file,
    import_messages,
    import_with_failing_library,
    in_presets,
    modified,
    objects,
    refusal,
    remembered,
    rendered,
    save_and_open,
    settings,
    shown,
    topology,
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
