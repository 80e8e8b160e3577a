"""The models that are hard or broken."""

from pathlib import Path

from tests.helpers.environment import MODELS, need_package

HARD = sorted(MODELS.glob("nasty/*.glb"))
# Models that cannot be compressed, and a word of the error.
REFUSED = {
    "AllIndicesOutOfRange": "vertices",
    "IndexOutOfRange": "vertices",
    "BoxWithInfinites": "no triangle has finite positions",
    "RecursiveNodes_cycle": "holds no triangles",
    "empty_nodes": "holds no triangles",
    **{
        f"Mesh_PrimitiveMode_{number}": "holds no triangles"
        for number in ("00", "01", "02", "03", "07", "08", "09", "10")
    },
}


def need_package_of(path: Path) -> None:
    """Skip the test if a model's compressed geometry needs a package that is not there."""
    for word, package in (("draco", "DracoPy"), ("meshopt", "meshoptimizer")):
        if word in path.stem.lower():
            need_package(package)
