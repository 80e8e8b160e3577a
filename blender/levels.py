# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels of detail beside the full meshes: as a proxy for the viewport, or as objects."""

import bpy

from . import proxies
from .decoding import add_mesh, load


class _Shown:
    """Which objects show which mesh, and the meshes of coarser levels that are added for them."""

    def __init__(self):
        self._meshes = []  # mesh -> index of its mesh of that level, for each level
        self._objects = []  # (object, mesh, skin)
        self._blender_meshes = {}  # (index of a mesh, skin) -> Blender's mesh

    def add(self, obj, vnode, gltf):
        """Notes an object. Instances of EXT_mesh_gpu_instancing have no node."""
        node = None if vnode.mesh_node_idx is None else gltf.data.nodes[vnode.mesh_node_idx]
        mesh = getattr(vnode, "mesh_idx", None) if node is None else node.mesh
        if mesh is not None and obj.type == "MESH":
            self._objects.append((obj, mesh, None if node is None else node.skin))

    def _add_level(self, gltf, decoded, finer, suffix):
        """Adds a mesh for each that is coarser than before; returns whether there is any."""
        coarser = {mesh for mesh, p in decoded if _count(decoded[mesh, p]) < _count(finer[mesh, p])}
        self._meshes.append(
            {
                mesh: add_mesh(gltf, mesh, decoded, f"{gltf.data.meshes[mesh].name}{suffix}")
                for mesh in sorted(coarser)
            }
        )
        return bool(coarser)

    def _blender_mesh(self, gltf, index, skin):
        """Blender's mesh of an added one."""
        if (index, skin) not in self._blender_meshes:
            self._blender_meshes[index, skin] = _importer_of_meshes().create(gltf, index, skin)
        return self._blender_meshes[index, skin]


class Proxies(_Shown):
    """A level in the viewport, and all triangles in renders."""

    def __init__(self, gltf, full, level):
        super().__init__()
        self._level = level
        self._add_level(gltf, load(gltf, level=level), full, " proxy")

    def finish(self, gltf):
        """Gives the objects their modifiers; returns (kind, text) of what to report."""
        (meshes,) = self._meshes
        stand_ins, with_keys = {}, 0
        for obj, mesh, skin in self._objects:
            if mesh not in meshes:
                continue
            if obj.data.shape_keys:  # those of another mesh would not move
                with_keys += 1
                continue
            if (mesh, skin) not in stand_ins:
                data = self._blender_mesh(gltf, meshes[mesh], skin)
                stand_ins[mesh, skin] = bpy.data.objects.new(data.name, data)
            proxies.add(obj, stand_ins[mesh, skin])
        text = f"level {self._level} of {len(stand_ins)} meshes is shown in the viewport"
        if with_keys:
            text += f"; {with_keys} objects with shape keys have no proxy"
        return [("INFO", text)]


class Objects(_Shown):
    """All levels as objects: level 0 as without levels, the others in hidden collections."""

    def __init__(self, gltf, full, _):
        super().__init__()
        finer, is_coarser = full, True
        while is_coarser:
            decoded = load(gltf, level=len(self._meshes) + 1)
            is_coarser = self._add_level(gltf, decoded, finer, f"_LOD{len(self._meshes) + 1}")
            finer = decoded
        self._meshes.pop()  # none is coarser

    def finish(self, gltf):
        """Adds the objects; returns (kind, text) of what to report."""
        for number, meshes in enumerate(self._meshes, 1):
            collection = bpy.data.collections.new(f"LOD{number}")
            bpy.context.collection.children.link(collection)
            collection.hide_viewport = collection.hide_render = True
            for obj, mesh, skin in self._objects:
                if mesh in meshes:
                    new = obj.copy()  # with its place, its modifiers and its animation
                    new.data = self._blender_mesh(gltf, meshes[mesh], skin)
                    new.name = f"{obj.name}_LOD{number}"
                    collection.objects.link(new)
        return [("INFO", f"{len(self._meshes) + 1} levels of detail, LOD1 and up are hidden")]


KINDS = {"PROXY": Proxies, "OBJECTS": Objects}


def _count(arrays):
    return len(arrays.indices)


def _importer_of_meshes():
    """The class of Blender's importer that creates meshes."""
    try:
        from io_scene_gltf2.blender.imp.mesh import BlenderMesh
    except ImportError:  # Blender 4.2
        from io_scene_gltf2.blender.imp.gltf2_blender_mesh import BlenderMesh
    return BlenderMesh
