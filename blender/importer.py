# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > glTF: decodes compressed primitives before Blender's importer reads them."""

import copy

import numpy as np

EXTENSION = "EXT_meshlet_edgebreaker"
TRANSPORT = "EXT_meshlet_transport"  # gltf_ext.load unpacks the file itself
UNSIGNED_INT = 5125  # glTF's component type of the decoded indices


class glTF2ImportUserExtension:
    """Hooks that Blender's glTF importer calls; it makes one object of this class per import."""

    def __init__(self):
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        # The importer refuses files that require an extension which no add-on names.
        self.extensions = [
            Extension(name=name, extension={}, required=True) for name in (EXTENSION, TRANSPORT)
        ]

    def gather_import_gltf_before_hook(self, gltf):
        """Decodes the whole file, or stops the import with the reason.

        Runs before the importer creates anything. gltf: the importer, with the parsed file.
        """
        try:
            _decode(gltf)
        except Exception as error:
            # The importer swallows exceptions of hooks and would go on with meshes of zeros.
            gltf.data = _Refusal(f"{gltf.filename}: {reason(error)}")


def _decode(gltf):
    """Gives each compressed primitive accessors with its decoded data. Raises MeshletError."""
    compressed = _compressed_primitives(gltf.data)
    if not compressed:
        return
    import gltf_ext

    decoded = {(p.mesh, p.primitive): p for p in gltf_ext.load(gltf.filename)}
    for place, primitive in compressed.items():
        if place not in decoded:  # load returns triangles only
            raise gltf_ext.MeshletError(
                f"mesh {place[0]} primitive {place[1]} is compressed, but not made of triangles",
                "the file is damaged; compress the original again",
                gltf.filename,
            )
        arrays = decoded.pop(place)
        primitive.indices = _add_accessor(gltf, primitive.indices, arrays.indices.reshape(-1, 1))
        gltf.data.accessors[primitive.indices].component_type = UNSIGNED_INT
        sets = [primitive.attributes, *(primitive.targets or [])]
        for names, values in zip(sets, arrays.sets, strict=True):
            for name, accessor in names.items():
                names[name] = _add_accessor(gltf, accessor, values[name])


def _compressed_primitives(data):
    """(mesh, primitive) -> the importer's object, of each primitive with the extension."""
    return {
        (m, p): primitive
        for m, mesh in enumerate(data.meshes or [])
        for p, primitive in enumerate(mesh.primitives or [])
        if EXTENSION in (primitive.extensions or {})
    }


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


def reason(error):
    """One line for the user, without the file."""
    if isinstance(error, ImportError):
        text = f"the library of this extension cannot be loaded ({error}); install it again"
    else:  # a MeshletError has a message
        text = getattr(error, "message", "") or f"{type(error).__name__}: {error}"
    return " ".join(text.split())


class _Refusal:
    """Takes the place of the importer's document: its first use ends the import with an error.

    The importer reports its own kind of error to the user, with the text that is given here.
    """

    def __init__(self, reason):
        self._reason = reason

    def __getattr__(self, name):
        from io_scene_gltf2.io.imp.gltf2_io_gltf import ImportError as ImportStopped

        raise ImportStopped(self._reason)
