"""What a driver offers of what this package uses, and the limits that bite."""

from __future__ import annotations

from typing import Any

from ..gpu import vk
from ..gpu.allocator import BLOCK_BYTES
from ..gpu.limits import Limits, read_limits
from ..gpu.physical import CAPABILITIES, CORE, NEEDED, OPTIONAL, Physical
from ..raster.mesh import MESH_PATHS
from ..renderer import PATHS
from ..scene.buffers import TEAM_ELEMENT_BYTES, TEAM_OTHER_BYTES, TEAM_STREAM_BYTES

RAYS = "rt"
TYPES = ("other", "integrated GPU", "discrete GPU", "virtual GPU", "software")
STREAMS = 4  # of a usual vertex: position, normal, texture coordinates, colour


def driver_report(device: Physical) -> dict[str, Any]:
    """Name, driver, versions, memory, extensions and features of a device, for JSON."""
    properties = vk.vkGetPhysicalDeviceProperties(device.handle)
    version, kind = properties.apiVersion, properties.deviceType
    families = vk.vkGetPhysicalDeviceQueueFamilyProperties(device.handle)
    own = _driver_properties(device) if version >= vk.VK_MAKE_VERSION(1, 2, 0) else {}
    return {
        "name": device.name,
        "type": TYPES[kind] if kind < len(TYPES) else "other",
        "vendor_id": properties.vendorID,
        "device_id": properties.deviceID,
        "driver": {"version": device.driver, **own},
        "api_version": _version(version),
        "heaps": _heaps(device),
        "queues": [
            {"count": f.queueCount, "flags": f.queueFlags, "timestamp_bits": f.timestampValidBits}
            for f in families
        ],
        "extensions": {
            name: name in device.extensions
            for extensions, _ in CAPABILITIES.values()
            for name in extensions
        },
        "features": _features(device),
    }


def _driver_properties(device: Physical) -> dict[str, str]:
    found = vk.VkPhysicalDeviceDriverProperties()
    vk.vkGetPhysicalDeviceProperties2(device.handle, vk.VkPhysicalDeviceProperties2(pNext=found))
    return {"name": _text(found.driverName), "info": _text(found.driverInfo)}


def _text(value: Any) -> str:
    return value if isinstance(value, str) else vk.ffi.string(value).decode(errors="replace")


def _version(packed: int) -> str:
    parts = (vk.VK_VERSION_MAJOR, vk.VK_VERSION_MINOR, vk.VK_VERSION_PATCH)
    return ".".join(str(part(packed)) for part in parts)


def _heaps(device: Physical) -> list[dict[str, Any]]:
    memory = vk.vkGetPhysicalDeviceMemoryProperties(device.handle)
    heaps = [memory.memoryHeaps[i] for i in range(memory.memoryHeapCount)]
    return [
        {
            "bytes": heap.size,
            "device_local": bool(heap.flags & vk.VK_MEMORY_HEAP_DEVICE_LOCAL_BIT),
        }
        for heap in heaps
    ]


def _features(device: Physical) -> dict[str, bool]:
    """Feature -> whether the device has it: what every path needs, then what some need."""
    core = vk.vkGetPhysicalDeviceFeatures(device.handle)
    structures = [NEEDED, *(features for _, features in CAPABILITIES.values())]
    wanted = [(s, m) for features in structures for s, members in features.items() for m in members]
    found = {m: not device.missing({s: (m,)}) for s, m in wanted if _may_ask(device, s)}
    return {**found, **{name: bool(getattr(core, name)) for name in OPTIONAL}}


def _may_ask(device: Physical, structure: str) -> bool:
    """Whether the driver knows a structure of features: that of an extension only if it has it."""
    version = vk.vkGetPhysicalDeviceProperties(device.handle).apiVersion
    core = {
        "VkPhysicalDeviceVulkan12Features": (1, 2, 0),
        "VkPhysicalDeviceVulkan13Features": (1, 3, 0),
    }
    if structure in core:
        return bool(version >= vk.VK_MAKE_VERSION(*core[structure]))
    return any(
        structure in features and all(e in device.extensions for e in extensions)
        for extensions, features in CAPABILITIES.values()
    )


# --- paths and limits ---


def why_not_offered(device: Physical) -> dict[str, str]:
    """Path -> why the device cannot run it; without the paths that it can."""
    fault = device.fault(NEEDED)
    if fault is not None:
        return dict.fromkeys((*PATHS, RAYS), fault.message)
    has = device.capabilities()
    needs = {name: capability for name, (_, capability) in PATHS.items()} | {RAYS: "raytracing"}
    reasons = {
        path: "the driver lacks " + ", ".join(_lacking(device, capability))
        for path, capability in needs.items()
        if capability and capability not in has
    }
    limits = limits_of(device)
    for path in MESH_PATHS:
        if path.name not in reasons and path.payload > limits.task_payload_bytes:
            reasons[path.name] = (
                f"a task workgroup passes on {limits.task_payload_bytes} bytes at most, "
                f"the path needs {path.payload}"
            )
    return reasons


def _lacking(device: Physical, capability: str) -> list[str]:
    """The extensions, or else the features, of a capability that a device lacks."""
    extensions, features = CAPABILITIES[capability]
    missing = [e for e in extensions if e not in device.extensions]
    if missing:
        return missing
    core = vk.vkGetPhysicalDeviceFeatures(device.handle)
    own = [CORE[capability]] if capability in CORE and not getattr(core, CORE[capability]) else []
    return own + device.missing(features)


def limits_of(device: Physical) -> Limits:
    """The limits of a device without a fault."""
    has = device.capabilities()
    return read_limits(device.handle, mesh="mesh" in has, raytracing="raytracing" in has)


def limits_report(device: Physical) -> list[dict[str, Any]]:
    """The limits that a scene or picture may meet: name, value, what it bounds and for which paths.

    Of a device without a fault.
    """
    limits, absent = limits_of(device), why_not_offered(device)
    rows: list[tuple[str, int, str, tuple[str, ...]]] = [
        ("image side", limits.picture_side, "pixels of a picture", tuple(PATHS)),
        ("texture side", limits.image_side, "pixels of a texture", (*PATHS, RAYS)),
        ("textures", limits.textures, "textures of a scene", (*PATHS, RAYS)),
        ("buffer", limits.buffer_bytes, "bytes of a scene's vertices or blobs", (*PATHS, RAYS)),
        (
            "allocations",
            limits.allocations,
            f"allocations of {BLOCK_BYTES >> 20} MiB or more",
            (*PATHS, RAYS),
        ),
        ("workgroups", limits.workgroups[1], "rows of 8 pixels of a picture", ("visibility",)),
        ("ray launch", limits.launch_invocations, "pixels of a picture", (RAYS,)),
        ("boxes", limits.structure_boxes, "boxes, 16 of a meshlet", (RAYS,)),
        ("instances", limits.structure_instances, "instances of a scene", (RAYS,)),
    ]
    by_elements: dict[int, list[str]] = {}
    rays = limits.compute_shared_bytes
    rooms = {"visibility": rays} | {p.name: p.shared_bytes(limits) for p in MESH_PATHS}
    for name, room in {**rooms, "stream": rays}.items():
        by_elements.setdefault(_elements(room), []).append(name)
    by_elements.setdefault(_elements(rays), []).append(RAYS)
    rows += [
        ("elements", most, "numbers of a vertex up to the last one that is drawn", tuple(names))
        for most, names in by_elements.items()
    ]
    return [
        {"limit": name, "most": most, "of": of, "paths": [p for p in paths if p not in absent]}
        for name, most, of, paths in rows
        if any(path not in absent for path in paths)
    ]


def _elements(shared_bytes: int) -> int:
    """Elements of a vertex that a team decodes in so much shared memory, at most."""
    free = shared_bytes - TEAM_OTHER_BYTES - STREAMS * TEAM_STREAM_BYTES
    return max(free // TEAM_ELEMENT_BYTES, 0)
