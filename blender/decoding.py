# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives the importer's document the decoded data, in accessors of its own."""

import copy

import numpy as np

EXTENSION = "EXT_meshlet_edgebreaker"
UNSIGNED_INT = 5125  # glTF's component type of the decoded indices


def compressed_primitives(data):
    """(mesh, primitive) -> the importer's object, of each primitive with the extension."""
    return {
        (m, p): primitive
        for m, mesh in enumerate(data.meshes or [])
        for p, primitive in enumerate(mesh.primitives or [])
        if EXTENSION in (primitive.extensions or {})
    }


def load(gltf, **detail):
    """(mesh, primitive) -> the decoded arrays of each compressed primitive. Raises MeshletError.

    detail: level or error, as gltf_ext.load takes them.
    """
    import gltf_ext

    decoded = {(p.mesh, p.primitive): p for p in gltf_ext.load(gltf.filename, **detail)}
    for place in compressed_primitives(gltf.data):
        if place not in decoded:  # load returns triangles only
            raise gltf_ext.MeshletError(
                f"mesh {place[0]} primitive {place[1]} is compressed, but not made of triangles",
                "the file is damaged; compress the original again",
                gltf.filename,
            )
    return {place: decoded[place] for place in compressed_primitives(gltf.data)}


def set_arrays(gltf, primitive, arrays):
    """Lets a primitive of the importer use decoded arrays. Raises MeshletError."""
    primitive.indices = _add_accessor(gltf, primitive.indices, arrays.indices.reshape(-1, 1))
    gltf.data.accessors[primitive.indices].component_type = UNSIGNED_INT
    sets = [primitive.attributes, *(primitive.targets or [])]
    for names, values in zip(sets, arrays.sets, strict=True):
        for name, accessor in names.items():
            names[name] = _add_accessor(gltf, accessor, values[name])


def add_mesh(gltf, mesh, decoded, name):
    """Index of a new mesh: a copy of another one with the arrays of another level."""
    new = copy.copy(gltf.data.meshes[mesh])
    new.name = name
    new.primitives = [copy.copy(primitive) for primitive in new.primitives]
    for number, primitive in enumerate(new.primitives):
        primitive.attributes = dict(primitive.attributes)
        primitive.targets = [dict(names) for names in primitive.targets or []] or None
        if (mesh, number) in decoded:
            others = {k: v for k, v in primitive.extensions.items() if k != EXTENSION}
            primitive.extensions = others or None
            set_arrays(gltf, primitive, decoded[mesh, number])
    gltf.data.meshes.append(new)
    return len(gltf.data.meshes) - 1


def _add_accessor(gltf, described_by, values):
    """Index of a new accessor of these values, [count, components], in a buffer of its own.

    New, because other primitives may use the old one, whose type and name it keeps.
    """
    from io_scene_gltf2.io.com.gltf2_io import Buffer, BufferView

    data = gltf.data
    content = np.ascontiguousarray(values).reshape(-1).view(np.uint8).data.toreadonly()
    data.buffers.append(Buffer.from_dict({"byteLength": len(content)}))
    buffer = len(data.buffers) - 1
    gltf.buffers[buffer] = content
    data.buffer_views.append(BufferView.from_dict({"buffer": buffer, "byteLength": len(content)}))
    accessor = copy.copy(data.accessors[described_by])
    accessor.buffer_view, accessor.byte_offset = len(data.buffer_views) - 1, None
    accessor.count, accessor.sparse = len(values), None
    data.accessors.append(accessor)
    return len(data.accessors) - 1
