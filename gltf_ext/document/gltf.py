"""glTF's JSON: the types of its objects, which are plain dictionaries, its constants and defaults.

The annotations are also the table by which `json_types.py` checks a file. Properties that are not
listed here stay in the dictionaries and are written again.
"""

from __future__ import annotations

from typing import Annotated, Any, TypedDict

BYTE, UNSIGNED_BYTE, SHORT, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = 4, 5, 6
TRIANGLE_MODES = (TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN)
NEAREST = 9728
REPEAT, CLAMP_TO_EDGE, MIRRORED_REPEAT = 10497, 33071, 33648
OPAQUE, MASK, BLEND = "OPAQUE", "MASK", "BLEND"
VERSION = "2.0"

# NaN and infinity are common in the bounds of accessors; readers compute them where they matter.
MAY_BE_INFINITE = "any numbers"
HAS_INDICES = "any JSON with numbers of objects"
Bounds = Annotated[list[float], MAY_BE_INFINITE]
Vec3 = Annotated[list[float], 3]  # the number is the length
Vec4 = Annotated[list[float], 4]
Matrix4 = Annotated[list[float], 16]
Attributes = dict[str, int]  # name -> accessor


class Property(TypedDict, total=False):
    """What every object may have."""

    extensions: dict[str, Annotated[Any, HAS_INDICES]]
    extras: Any


class NamedProperty(Property, total=False):
    """An object with a name."""

    name: str


class Asset(Property, total=False):
    """About the file."""

    generator: str
    copyright: str
    version: str
    minVersion: str


class SparseIndices(Property, total=False):
    """Numbers of the elements that a sparse accessor replaces."""

    bufferView: int
    byteOffset: int
    componentType: int


class SparseValues(Property, total=False):
    """Replacements of these elements."""

    bufferView: int
    byteOffset: int


class Sparse(Property, total=False):
    """The sparse part of an accessor."""

    count: int
    indices: SparseIndices
    values: SparseValues


class Accessor(NamedProperty, total=False):
    """A typed array in a buffer view."""

    bufferView: int
    byteOffset: int
    componentType: int
    normalized: bool
    count: int
    type: str
    sparse: Sparse
    max: Bounds
    min: Bounds


class BufferView(NamedProperty, total=False):
    """A range of bytes of a buffer."""

    buffer: int
    byteOffset: int
    byteLength: int
    byteStride: int
    target: int


class Buffer(Property, total=False):
    """Bytes of the binary chunk, of a file or of a data: uri."""

    uri: str
    byteLength: int


class _Primitive(TypedDict):
    attributes: Attributes


class Primitive(_Primitive, Property, total=False):
    """Triangles, lines or points with one material."""

    indices: int
    mode: int
    material: int
    targets: list[Attributes]


class _Mesh(TypedDict):
    primitives: list[Primitive]


class Mesh(_Mesh, NamedProperty, total=False):
    """Primitives, and weights of their morph targets."""

    weights: list[float]


class Perspective(Property, total=False):
    """The lens of a perspective camera."""

    aspectRatio: float
    yfov: float
    zfar: float
    znear: float


class Orthographic(Property, total=False):
    """The lens of an orthographic camera."""

    xmag: float
    ymag: float
    zfar: float
    znear: float


class Camera(NamedProperty, total=False):
    """A camera of either type."""

    perspective: Perspective
    orthographic: Orthographic
    type: str


class TextureInfo(Property, total=False):
    """A material's use of a texture."""

    index: int
    texCoord: int


class NormalTextureInfo(TextureInfo, total=False):
    """The same of a normal texture."""

    scale: float


class OcclusionTextureInfo(TextureInfo, total=False):
    """The same of an occlusion texture."""

    strength: float


class PbrMetallicRoughness(Property, total=False):
    """The metallic-roughness model of a material."""

    baseColorFactor: Vec4
    metallicFactor: float
    roughnessFactor: float
    baseColorTexture: TextureInfo
    metallicRoughnessTexture: TextureInfo


class Material(NamedProperty, total=False):
    """The look of a primitive."""

    pbrMetallicRoughness: PbrMetallicRoughness
    normalTexture: NormalTextureInfo
    occlusionTexture: OcclusionTextureInfo
    emissiveFactor: Vec3
    emissiveTexture: TextureInfo
    alphaMode: str
    alphaCutoff: float
    doubleSided: bool


class Sampler(Property, total=False):
    """Filters and wrapping of a texture."""

    magFilter: int
    minFilter: int
    wrapS: int
    wrapT: int


class Texture(NamedProperty, total=False):
    """An image with a sampler."""

    sampler: int
    source: int


class Image(NamedProperty, total=False):
    """An encoded image in a buffer view, a file or a data: uri."""

    uri: str
    mimeType: str
    bufferView: int


class Node(NamedProperty, total=False):
    """A node of the scene graph, with its place."""

    mesh: int
    skin: int
    rotation: Vec4
    translation: Vec3
    scale: Vec3
    children: list[int]
    matrix: Matrix4
    camera: int


class Scene(NamedProperty, total=False):
    """Root nodes."""

    nodes: list[int]


class Skin(NamedProperty, total=False):
    """Joints of a skinned mesh."""

    inverseBindMatrices: int
    skeleton: int
    joints: list[int]


class ChannelTarget(Property, total=False):
    """The property that an animation moves."""

    node: int
    path: str


class AnimationSampler(Property, total=False):
    """Key frames."""

    input: int
    interpolation: str
    output: int


class Channel(Property, total=False):
    """Connects key frames with a property."""

    sampler: int
    target: ChannelTarget


class _Animation(TypedDict):
    channels: list[Channel]
    samplers: list[AnimationSampler]


class Animation(_Animation, NamedProperty, total=False):
    """Key frames of several properties."""


class _Lists(TypedDict):
    accessors: list[Accessor]
    animations: list[Animation]
    bufferViews: list[BufferView]
    buffers: list[Buffer]
    cameras: list[Camera]
    extensionsRequired: list[str]
    extensionsUsed: list[str]
    images: list[Image]
    materials: list[Material]
    meshes: list[Mesh]
    nodes: list[Node]
    samplers: list[Sampler]
    scenes: list[Scene]
    skins: list[Skin]
    textures: list[Texture]


class Root(_Lists, Property, total=False):
    """The whole file. Here all lists are there; those that are empty are not written."""

    asset: Asset
    scene: int


# --- defaults ---


def byte_offset(holder: Accessor | SparseIndices | SparseValues | BufferView) -> int:
    """Return the first byte, of a buffer view's buffer or of an accessor's view."""
    return holder.get("byteOffset", 0)


def stride(view: BufferView, size: int) -> int:
    """Return the offset of an element to the next one, in bytes. size: of an element."""
    return view.get("byteStride") or size


def mode(primitive: Primitive) -> int:
    """Return the mode of a primitive: 4 for triangles."""
    return primitive.get("mode", TRIANGLES)


def has_triangles(primitive: Primitive) -> bool:
    """Return whether a primitive is a list, strip or fan of triangles that have positions."""
    return mode(primitive) in TRIANGLE_MODES and "POSITION" in primitive["attributes"]


def attribute_sets(primitive: Primitive) -> list[Attributes]:
    """Return the attributes, then those of each morph target."""
    return [primitive["attributes"], *primitive.get("targets", [])]


def set_attribute_sets(primitive: Primitive, sets: list[Attributes]) -> None:
    """Set copies of the attributes and of those of each morph target."""
    attributes, *targets = map(dict, sets)
    primitive["attributes"] = attributes
    if targets:
        primitive["targets"] = targets


def children(node: Node) -> list[int]:
    """Return the nodes below."""
    return node.get("children", [])


# --- extensions ---


def has_extension(holder: Property, name: str) -> bool:
    """Return whether an object has the extension."""
    return name in holder.get("extensions", {})


def extension(holder: Property, name: str) -> Any:
    """Return the JSON of an object's extension; None if there is none."""
    return holder.get("extensions", {}).get(name)


def pop_extension(holder: Property, name: str) -> Any:
    """Remove an object's extension and return its JSON, None if there is none."""
    extensions = holder.get("extensions", {})
    value = extensions.pop(name, None)
    if not extensions:
        holder.pop("extensions", None)
    return value


def set_extension(holder: Property, name: str, value: Any) -> None:
    """Give an object an extension."""
    holder.setdefault("extensions", {})[name] = value
