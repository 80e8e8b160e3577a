# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > glTF: decodes compressed primitives before Blender's importer reads them."""

from pathlib import Path

from . import levels
from .compression import reason
from .decoding import EXTENSION, compressed_primitives, load, set_arrays
from .settings import detail_options

TRANSPORT = "EXT_meshlet_transport"  # gltf_ext.load unpacks the file itself
LEVELS = "EXT_meshlet_lod"


class glTF2ImportUserExtension:
    """Hooks that Blender's glTF importer calls; it makes one object of this class per import.

    messages: (kind, text) of what to report on the last file.
    """

    def __init__(self):
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        # The importer refuses files that require an extension which no add-on names.
        self.extensions = [
            Extension(name=name, extension={}, required=True) for name in (EXTENSION, TRANSPORT)
        ]
        self.messages, self._shown = [], None

    def gather_import_gltf_before_hook(self, gltf):
        """Decodes the whole file, or stops the import with the reason.

        Runs before the importer creates anything. gltf: the importer, with the parsed file.
        """
        self.messages, self._shown = [], None
        try:
            self._decode(gltf)
        except Exception as error:
            # The importer swallows exceptions of hooks and would go on with meshes of zeros.
            gltf.data = _Refusal(f"{gltf.filename}: {reason(error)}")

    def gather_import_node_after_hook(self, vnode, gltf_node, obj, gltf):
        """Notes which objects show which mesh."""
        if self._shown is not None:
            self._shown.add(obj, vnode, gltf)

    def gather_import_scene_after_animation_hook(self, gltf_scene, blender_scene, gltf):
        """Adds proxies or further objects, when all objects and animations are there."""
        if self._shown is not None:
            self.messages += self._shown.finish(gltf)

    def _decode(self, gltf):
        """Gives each compressed primitive accessors with its decoded data. Raises MeshletError."""
        primitives = compressed_primitives(gltf.data)
        if not primitives:
            return
        kind, options = detail_options(gltf.import_settings)
        if kind != "FULL" and LEVELS not in (gltf.data.extensions_used or []):
            name = Path(gltf.filename).name
            text = f"{name} has no levels of detail: all triangles are imported"
            self.messages, kind = [("WARNING", text)], "FULL"
        full = load(gltf, **(options if kind in ("LEVEL", "ERROR") else {}))
        if kind in levels.KINDS:
            self._shown = levels.KINDS[kind](gltf, full, options["level"])
        for place, primitive in primitives.items():
            set_arrays(gltf, primitive, full[place])


class _Refusal:
    """Takes the place of the importer's document: its first use ends the import with an error.

    The importer reports its own kind of error to the user, with the text that is given here.
    """

    def __init__(self, reason):
        self._reason = reason

    def __getattr__(self, name):
        from io_scene_gltf2.io.imp.gltf2_io_gltf import ImportError as ImportStopped

        raise ImportStopped(self._reason)
