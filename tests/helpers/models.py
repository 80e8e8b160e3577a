"""The models that are hard or broken."""

from tests.helpers.environment import MODELS

HARD = sorted(MODELS.glob("nasty/*.glb"))
# Models that cannot be compressed, and a word of the error.
REFUSED = {
    "AllIndicesOutOfRange": "vertices",
    "IndexOutOfRange": "vertices",
    "BoxWithInfinites": "no triangle has finite positions",
    "Box_meshopt": "meshopt",
    "RecursiveNodes_cycle": "holds no triangles",
    "empty_nodes": "holds no triangles",
    **{
        f"Mesh_PrimitiveMode_{number}": "holds no triangles"
        for number in ("00", "01", "02", "03", "07", "08", "09", "10")
    },
}
