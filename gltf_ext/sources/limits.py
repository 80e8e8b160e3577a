"""How many vertices and triangles a primitive may have, checked before they are counted on."""

from __future__ import annotations

from gltf_ext.errors import MeshletError

MAX_VERTICES = (1 << 31) - 1  # readers number them with int32
MAX_TRIANGLES = (1 << 32) // 3  # decoders number corners with 32 bits


def check_vertex_count(count: int, kind: str = "vertices") -> None:
    """Raise MeshletError for more rows of a kind than readers can number."""
    if count > MAX_VERTICES:
        raise MeshletError(f"has {count:,} {kind}, more than {MAX_VERTICES:,}", "split the model")


def check_triangle_count(count: int, where: str = "") -> None:
    """Raise MeshletError for more triangles than a primitive may have. where: its place, if any."""
    if count > MAX_TRIANGLES:
        raise MeshletError(
            f"{where} has {count:,} triangles, more than {MAX_TRIANGLES:,}".lstrip(),
            "split the model",
        )
