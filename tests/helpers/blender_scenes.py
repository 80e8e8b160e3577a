"""Scenes for the tests in Blender; blender_driver.py imports this module inside Blender."""

from __future__ import annotations

import math

import bpy
import numpy as np


def empty() -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def add_mesh(name: str, points, faces):
    """An object with a mesh of these points and faces."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def primitive(kind: str, uv: bool = True, **values) -> None:
    """One of Blender's own meshes in an empty file; with uv, its seams are borders in glTF."""
    empty()
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**values)
    for mesh in bpy.data.meshes:
        mesh.shade_smooth()
        while mesh.uv_layers and not uv:
            mesh.uv_layers.remove(mesh.uv_layers[0])


def scale_objects(scale: float) -> None:
    """Sets the scale of all objects, which is not applied to their meshes."""
    for item in bpy.data.objects:
        item.scale = (scale,) * 3


def duplicate_objects(count: int) -> None:
    """Copies of each mesh's object beside it, which share its mesh and armature."""
    for item in [item for item in bpy.data.objects if item.type == "MESH"]:
        for number in range(1, count):
            new = item.copy()
            new.location.x += 3 * number
            bpy.context.scene.collection.objects.link(new)


def rigged_cylinder(rings: int = 100, shape_key: bool = False) -> None:
    """A wavy tube, bent by an armature of two bones; with UV seams."""
    empty()
    count = 32
    rows = [
        [
            (
                (1 + 0.1 * math.sin(z / 5)) * math.cos(math.tau * a / count),
                (1 + 0.1 * math.sin(z / 5)) * math.sin(math.tau * a / count),
                8 * z / rings,
            )
            for a in range(count)
        ]
        for z in range(rings)
    ]
    faces = [
        (z * count + a, z * count + b, (z + 1) * count + b, (z + 1) * count + a)
        for z in range(rings - 1)
        for a, b in ((a, (a + 1) % count) for a in range(count))
    ]
    item = add_mesh("tube", [point for row in rows for point in row], faces)
    layer = item.data.uv_layers.new()
    for polygon in item.data.polygons:
        for corner, loop in enumerate(polygon.loop_indices):
            turn = polygon.index % count + (corner in (1, 2))
            height = polygon.index // count + (corner in (2, 3))
            layer.data[loop].uv = (turn / count, height / rings)
    item.data.shade_smooth()
    if shape_key:
        item.shape_key_add(name="Basis")
        key = item.shape_key_add(name="Wide")
        for point in key.data:
            point.co.x *= 1.5
    armature = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for number, name in enumerate(("low", "high")):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = (0, 0, 4 * number), (0, 0, 4 * number + 4)
    armature.data.edit_bones["high"].parent = armature.data.edit_bones["low"]
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, sign in (("low", -1), ("high", 1)):
        group = item.vertex_groups.new(name=name)
        for vertex in item.data.vertices:
            group.add([vertex.index], min(max(0.5 + sign * (vertex.co.z - 4), 0), 1), "REPLACE")
    item.parent = armature
    item.modifiers.new("Armature", "ARMATURE").object = armature


def posed() -> list:
    """The box of what is shown when the upper bone is turned by a quarter."""
    (armature,) = (item for item in bpy.data.objects if item.type == "ARMATURE")
    bone = armature.pose.bones["high"]
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = (math.pi / 2, 0, 0)
    graph = bpy.context.evaluated_depsgraph_get()
    item = next(item for item in bpy.data.objects if item.name.startswith("tube"))
    mesh = item.evaluated_get(graph).data
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3)
    return [*points.min(axis=0).tolist(), *points.max(axis=0).tolist()]


def neighbours() -> None:
    """A large strip and a small one, which share the 101 points of a border."""
    empty()

    def strip(name: str, left: float, right: float, columns: int) -> None:
        xs = np.linspace(left, right, columns + 1)
        points = [(x, y, 0.1 * math.sin(y)) for y in np.linspace(-5, 5, 101) for x in xs]
        wide = columns + 1
        faces = [
            (y * wide + x, y * wide + x + 1, (y + 1) * wide + x + 1, (y + 1) * wide + x)
            for y in range(100)
            for x in range(columns)
        ]
        add_mesh(name, points, faces)

    strip("ground", -33.3, 5.0, 20)
    strip("path", 5.0, 5.37, 3)


def dark_gradient() -> None:
    """A grid whose colour rises from black in 65 levels of 255, by the material that it shows."""
    primitive("grid", x_subdivisions=64, y_subdivisions=64)
    mesh = bpy.context.object.data
    colours = mesh.color_attributes.new("Col", "BYTE_COLOR", "CORNER")
    for loop, colour in zip(mesh.loops, colours.data):
        level = round((mesh.vertices[loop.vertex_index].co.x + 1) / 2 * 64) / 255
        colour.color_srgb = (level, level / 2, level / 4, 1)
    material = bpy.data.materials.new("M")
    mesh.materials.append(material)
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Col"
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(node.outputs[0], shader.inputs[0])


def measured_gradient() -> list:
    """Levels of red in it, and the largest error in 255 levels of sRGB."""
    (mesh,) = bpy.data.meshes
    (attribute,) = mesh.color_attributes
    levels, largest = set(), 0.0
    domain = attribute.domain
    for index, colour in enumerate(attribute.data):
        vertex = mesh.loops[index].vertex_index if domain == "CORNER" else index
        level = round((mesh.vertices[vertex].co.x + 1) / 2 * 64)
        red, green, blue = (255 * value for value in colour.color_srgb[:3])
        levels.add(round(red))
        # Blender keeps 8 bits: halves and quarters are rounded before.
        errors = (red - level, green - round(level / 2), blue - round(level / 4))
        largest = max(largest, *map(abs, errors))
    return [len(levels), largest]


def textured_sphere() -> None:
    """A sphere with an image as its colour."""
    primitive("uv_sphere")
    image = bpy.data.images.new("pixels", 4, 4)
    image.pack()
    material = bpy.data.materials.new("M")
    bpy.context.object.data.materials.append(material)
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(node.outputs[0], shader.inputs[0])


FUNCTIONS = (
    dark_gradient,
    duplicate_objects,
    measured_gradient,
    neighbours,
    posed,
    primitive,
    rigged_cylinder,
    scale_objects,
    textured_sphere,
)
