"""Reading primitives compressed with KHR_draco_mesh_compression, through the optional package DracoPy."""

from __future__ import annotations

import numpy as np
import pygltflib

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import accessor_format
from gltf_ext.gltf.document import Document, item, named_indices

DRACO = "KHR_draco_mesh_compression"


def decode_draco(
    document: Document, primitive: pygltflib.Primitive, where: str
) -> dict[str, np.ndarray]:
    """Attribute name -> [V, components] in the accessor's type, and "indices" -> uint32[3 T]."""
    try:
        import DracoPy
    except ImportError:
        raise MeshletError(
            f"{where} is compressed with Draco", "install DracoPy to read it: pip install DracoPy"
        ) from None
    extension = primitive.extensions[DRACO]
    if not isinstance(extension, dict) or not isinstance(extension.get("attributes"), dict):
        raise MeshletError(f"{where} has a malformed {DRACO} object", "export the model again")
    try:
        mesh = DracoPy.decode(bytes(document.bytes_of_view(extension.get("bufferView"))))
        data = [
            (attribute["unique_id"], np.asarray(attribute["data"])) for attribute in mesh.attributes
        ]
        faces = np.asarray(mesh.faces)
    except MeshletError:
        raise
    except Exception:  # DracoPy raises whatever its C++ library does
        raise MeshletError(
            f"Draco data of {where} cannot be decoded", "export the model again"
        ) from None
    result = {}
    for name, accessor in named_indices(primitive.attributes).items():
        if name in extension["attributes"]:
            values = next(
                (array for unique_id, array in data if unique_id == extension["attributes"][name]),
                None,
            )
            dtype, components = accessor_format(
                item(document.accessors, accessor, f"the accessor of {name} of {where},"), name
            )
            if values is None or values.ndim != 2 or values.shape[1] != components:
                raise MeshletError(
                    f"Draco data of {where} has no {name} of {components} components",
                    "export the model again",
                )
            result[name] = np.ascontiguousarray(values, dtype)
    vertices = {len(values) for values in result.values()}
    if (
        len(vertices) != 1
        or faces.ndim != 2
        or faces.shape[1] != 3
        or (faces.size and not 0 <= faces.min() <= faces.max() < min(vertices))
    ):
        raise MeshletError(f"Draco data of {where} is inconsistent", "export the model again")
    result["indices"] = faces.astype(np.uint32).ravel()
    return result
