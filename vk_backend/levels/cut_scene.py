"""The clusters of a cut as a scene, for ray tracing: rays need the detail that one camera needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gltf_ext.lod.cuts import View, cut_for_view

from ..gpu.errors import VulkanError
from ..scene.camera import Camera
from ..scene.instances import Instance, Instances
from ..scene.scene import Primitive, Scene
from .hierarchies import Hierarchies

MAX_CUTS = 1 << 14  # instances: the host takes a millisecond for each


def cut_scene(scene: Scene, camera: Camera, width: int, height: int, pixels: float) -> Scene:
    """A scene that was loaded with levels, as one without: each instance has the cut of a camera.

    pixels: error of the cut. What is out of view has a cut, too, because light comes from there. A
    primitive of the result is a page, or the clusters of it that a cut needs; instances that need
    the same share it. Raises MeshletError for malformed pages, VulkanError for too many instances.
    """
    if len(scene.instances) > MAX_CUTS:
        raise VulkanError(
            f"{len(scene.instances):,} instances are too many to choose levels for rays, at most "
            f"{MAX_CUTS:,}",
            "choose --path visibility, or leave out --lod-error",
        )
    h = Hierarchies(scene)
    x, y, z, is_point = camera.eye
    view = View((x, y, z) if is_point else None, camera.pixels_per_unit(width, height))
    primitives: list[Primitive] = []
    instances: list[Instance] = []
    made: dict[tuple[int, bytes], int] = {}  # (page, clusters) -> primitive
    blobs: dict[int, bytes] = {}
    for instance in scene.instances:
        levels = h.primitives[instance.primitive]
        first_page = int(h.first_page[instance.primitive])
        begins = np.append(
            0, np.cumsum(h.clusters[first_page : h.first_page[instance.primitive + 1]])
        )
        cut = cut_for_view(levels.tables, view, pixels, matrix=instance.matrix)
        for number, page in enumerate(cut.pages.tolist()):
            first, end = int(begins[page]), int(begins[page + 1])
            drawn = np.flatnonzero(cut.drawn[first:end])
            key = first_page + page, drawn.tobytes()
            if key not in made:
                made[key] = len(primitives)
                if key[0] not in blobs:
                    blobs[key[0]] = h.read(key[0])
                primitives.append(
                    replace(
                        scene.primitives[instance.primitive],
                        blob=blobs[key[0]],
                        source=None,
                        triangles=int(levels.cluster_triangles[first + drawn].sum()),
                        meshlets=len(drawn),
                        first_meshlet=first,
                        chosen=drawn,
                    )
                )
            instances.append(replace(instance, primitive=made[key], page=number))
    return replace(scene, primitives=primitives, instances=Instances.of(instances))
