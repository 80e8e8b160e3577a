"""Where a document refers to its accessors and buffer views, extensions included."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from gltf_ext.document import gltf
from gltf_ext.document.document import Document

Renumber = Callable[[int], int]
KINDS = ("accessor", "bufferview")  # what extensions refer to
# A key of any extension that says that its value refers to one: bufferView, arrayOffsetBufferView,
# accessors, dataAccessorIndex. A value out of range is no reference, but for a bufferView.
NAMED = re.compile(r"(?i)(?:.*[a-z_])?(accessor|buffer_?view)(?:s|_?ind(?:ex|ices)|_?ids?)?")
# Keys that glTF uses for accessors, and what accessors hold. In an unknown extension their integers
# may be anything.
AMBIGUOUS = (
    *("attributes", "indices", "inverseBindMatrices", "input", "output", "values"),
    *("positions", "normals", "tangents", "colors", "texcoords", "uvs", "weights", "joints"),
    *("vertices", "points", "triangles", "faces", "edges"),
)


@dataclass(frozen=True)
class Schema:
    """Further keys of an extension whose integers refer to accessors or buffer views."""

    accessors: tuple[str, ...] = ()
    views: tuple[str, ...] = ()


NONE = Schema()
MICROMAP = Schema(("mapIndices", "directions", "directionBounds", "primitiveFlags"))
SCHEMAS = {
    "BENTLEY_primitive_restart": Schema(("indices",)),
    "CESIUM_primitive_outline": Schema(("indices",)),
    "EXT_mesh_gpu_instancing": Schema(("attributes",)),
    "EXT_mesh_manifold": Schema(("attributes", "indices", "mergeIndices", "mergeValues")),
    "EXT_mesh_primitive_edge_visibility": Schema(
        ("visibility", "silhouetteNormals", "indices", "attributes")
    ),
    "EXT_mesh_primitive_restart": Schema(("indices",)),
    "EXT_structural_metadata": Schema(views=("values", "arrayOffsets", "stringOffsets")),
    "MPEG_audio_spatial": Schema(("pointers",)),
    "MPEG_mesh_linking": Schema(("correspondence", "pose", "weights")),
    "MPEG_viewport_recommended": Schema(("translation", "rotation", "parameters")),
    "NV_attribute_micromap": MICROMAP,
    "NV_displacement_micromap": MICROMAP,
    "NV_micromap_tooling": MICROMAP,
    "NV_opacity_micromap": MICROMAP,
    "ULTRA_RigidBodyColliders": Schema(views=("vertices", "faces")),
}
# Extensions that have ambiguous keys, or may have, but no references other than named ones.
KNOWN_PREFIXES = (
    "ADOBE_materials_",
    "AGI_",
    "BENTLEY_materials_",
    "CESIUM_RTC",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_lights_",
    "EXT_mesh_features",
    "EXT_meshlet_",
    "EXT_texture_",
    "FB_",
    "GODOT_",
    "KHR_animation_pointer",
    "KHR_audio",
    "KHR_collision_shapes",
    "KHR_draco_mesh_compression",
    "KHR_gaussian_splatting",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_mesh_quantization",
    "KHR_node_",
    "KHR_physics_",
    "KHR_rigid_bodies",
    "KHR_techniques_webgl",
    "KHR_texture_",
    "KHR_xmp",
    "MOZ_",
    "MSFT_",
    "OMI_",
    "VRM",
)


def extensions_of(value: Any) -> list[tuple[str, Any]]:
    """Return (name, object) of every extension in JSON, nested ones included."""
    extensions: list[tuple[str, Any]] = []
    queue = [value]
    for holder in queue:  # which grows meanwhile: a call for each value would take thrice as long
        if isinstance(holder, list):
            children = holder
        elif "extensions" in holder or "extras" in holder:
            children = [v for key, v in holder.items() if key not in ("extensions", "extras")]
            inner = holder.get("extensions")
            if isinstance(inner, dict):
                extensions += inner.items()
                children += inner.values()
            else:
                children.append(inner)
        else:
            children = holder.values()
        queue += [child for child in children if child and isinstance(child, (dict, list))]
    return extensions


def map_accessors(document: Document, renumber: Renumber) -> None:
    """Replace every accessor index by renumber(index)."""
    for mesh in document.meshes:
        for primitive in mesh["primitives"]:
            for attributes in gltf.attribute_sets(primitive):
                _map_values(attributes, renumber)
            _map_field(primitive, "indices", renumber)
    for animation in document.animations:
        for sampler in animation["samplers"]:
            _map_field(sampler, "input", renumber)
            _map_field(sampler, "output", renumber)
    for skin in document.skins:
        _map_field(skin, "inverseBindMatrices", renumber)
    for name, value in extensions_of(document.json):
        map_extension(name, value, "accessor", len(document.accessors), renumber)


def map_views(document: Document, renumber: Renumber) -> None:
    """Replace every buffer view index by renumber(index)."""
    for accessor in document.accessors:
        _map_field(accessor, "bufferView", renumber)
        sparse = accessor.get("sparse", {})
        _map_field(sparse.get("indices", {}), "bufferView", renumber)
        _map_field(sparse.get("values", {}), "bufferView", renumber)
    for image in document.images:
        _map_field(image, "bufferView", renumber)
    for name, value in extensions_of(document.json):
        map_extension(name, value, "bufferview", len(document.bufferViews), renumber)


def _map_field(owner: Any, field: str, renumber: Renumber) -> None:
    if field in owner:
        owner[field] = renumber(owner[field])


def _map_values(attributes: dict[str, Any], renumber: Renumber) -> None:
    for name, index in attributes.items():
        attributes[name] = renumber(index)


def map_extension(name: str, value: Any, kind: str, count: int, renumber: Renumber) -> None:
    """Renumber an extension's references of a kind ("accessor" or "bufferview").

    count: of what they refer to.
    """
    schema = SCHEMAS.get(name, NONE)
    keys = schema.accessors if kind == "accessor" else schema.views

    def change(index: int, key: str) -> int:
        is_strict = key in keys or key == "bufferView"
        return renumber(index) if is_strict or 0 <= index < count else index

    _map_keys(value, lambda key: key in keys or _named_kind(key) == kind, change)


def _named_kind(key: str) -> str:
    match = NAMED.fullmatch(key)
    return match[1].lower().replace("_", "") if match else ""


def _map_keys(
    value: Any, is_reference: Callable[[str], bool], change: Callable[[int, str], int]
) -> None:
    """Change the integers under some keys, in lists and objects too.

    Leaves out nested extensions, which `extensions_of` lists.
    """
    if isinstance(value, list):
        for v in value:
            _map_keys(v, is_reference, change)
    elif isinstance(value, dict):
        for key, v in value.items():
            if key in ("extensions", "extras"):
                continue
            if not is_reference(key):
                _map_keys(v, is_reference, change)
            elif isinstance(v, (dict, list)):
                _map_members(v, key, is_reference, change)
            elif type(v) is int:
                value[key] = change(v, key)


def _map_members(
    holder: Any,
    key: str,
    is_reference: Callable[[str], bool],
    change: Callable[[int, str], int],
) -> None:
    """Change the integers in a list or an object under a key; go on into what else it has."""
    for place, v in list(holder.items() if isinstance(holder, dict) else enumerate(holder)):
        if type(v) is int:
            holder[place] = change(v, key)
        else:
            _map_keys(v, is_reference, change)


# --- unknown extensions ---


def note_orphans(document: Document) -> None:
    """Note the accessors and buffer views of a file that nothing refers to, as far as is known.

    An unknown extension that has their numbers may be what they are for.
    """
    if next(_unknown_extensions(document), None) is None:
        return
    used: set[int] = set()

    def note(index: int) -> int:
        used.add(index)
        return index

    map_accessors(document, note)
    document.orphans["accessor"] = set(range(len(document.accessors))) - used
    used.clear()
    map_views(document, note)
    document.orphans["bufferview"] = set(range(len(document.bufferViews))) - used


def ambiguous_references(document: Document, kind: str) -> dict[str, set[int]]:
    """Unknown extension -> integers that may refer to some of a kind, or to anything.

    kind: "accessor" or "bufferview". Those under a key that glTF has for references, and all that
    are numbers of orphans.
    """
    count = len(document.accessors if kind == "accessor" else document.bufferViews)
    result: dict[str, set[int]] = {}
    for name, value in _unknown_extensions(document):
        numbers = {n for n in integers_under(value, AMBIGUOUS) if 0 <= n < count}
        if document.orphans[kind]:
            numbers |= document.orphans[kind].intersection(integers_of(value))
        if numbers:
            result.setdefault(name, set()).update(numbers)
    return result


def pinned_numbers(document: Document, kind: str) -> set[int]:
    """Return the numbers of accessors or buffer views that stay as they are. kind: as above."""
    return set().union(*ambiguous_references(document, kind).values())


def is_known(name: str) -> bool:
    """Return whether an extension's references are known."""
    return name in SCHEMAS or name.startswith(KNOWN_PREFIXES)


def _unknown_extensions(document: Document) -> Iterator[tuple[str, Any]]:
    for name, value in extensions_of(document.json):
        if not is_known(name):
            yield name, value


def integers_of(value: Any) -> Iterator[int]:
    """Yield all integers of an extension, without those of nested ones."""
    if type(value) is int:
        yield value
    elif isinstance(value, list):
        for v in value:
            yield from integers_of(v)
    elif isinstance(value, dict):
        for key, v in value.items():
            if key not in ("extensions", "extras"):
                yield from integers_of(v)


def integers_under(value: Any, keys: tuple[str, ...]) -> list[int]:
    """List the integers under some keys, in lists and objects too."""
    numbers: list[int] = []

    def note(index: int, key: str) -> int:
        numbers.append(index)
        return index

    _map_keys(value, lambda key: key in keys, note)
    return numbers


def named_accessors(name: str, value: Any, count: int) -> list[int]:
    """List the accessors that an extension refers to, and those that it may refer to."""
    numbers = [] if name.startswith(KNOWN_PREFIXES) else integers_under(value, AMBIGUOUS)

    def note(index: int) -> int:
        numbers.append(index)
        return index

    map_extension(name, value, "accessor", count, note)
    return [n for n in numbers if 0 <= n < count]
