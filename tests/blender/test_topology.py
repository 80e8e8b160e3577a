"""Compressed files come back as plain ones do: closed, in as many islands, ready for modifiers."""

import pytest

import gltf_ext
from tests.helpers.environment import MODELS, missing

pytestmark = pytest.mark.full
REAL = ("igea", "dragon", "DamagedHelmet", "suzanne", "beast")
# Blender's own meshes: closed, with more than one page, with slivers, with seams.
OWN = {
    "ico": ("ico_sphere", {"subdivisions": 7}),
    "uv": ("uv_sphere", {"segments": 192, "ring_count": 96}),
    "disc": ("circle", {"vertices": 192, "fill_type": "NGON"}),
    "monkey": ("monkey", {}),
}
# What a modifier makes of a mesh that is torn is another shape: cracks and shatters.
MODIFIERS = {
    "SMOOTH": {"factor": 0.5, "iterations": 20},
    "DECIMATE": {"ratio": 0.3},
}


def exported(blender, folder, **options):
    """The open file, exported plain and compressed."""
    plain, ours = folder / "plain.glb", folder / "ours.glb"
    blender("export_open", plain, enabled=False)
    result = blender("export_open", ours, **options)
    assert "times smaller" in result[-1], result
    return plain, ours


def topologies(blender, *paths):
    result = []
    for path in paths:
        assert blender("import_file", path) == ""
        result.append(blender("topology"))
    return result


@pytest.mark.parametrize("lod", [False, True])
@pytest.mark.parametrize("name", OWN)
def test_own_meshes(blender, tmp_path, name, lod):
    kind, values = OWN[name]
    blender("primitive", kind, **values)
    first, second = topologies(blender, *exported(blender, tmp_path, lod=lod))
    assert first == second and first["triangles"] > 100


def assert_same(blender, folder):
    """What the open file becomes has the topology of the plain export.

    Equal vertices of a mesh whose faces share none are one vertex of ours: then less is open.
    """
    plain, ours = exported(blender, folder)
    first, second = topologies(blender, plain, ours)
    report = gltf_ext.compress(plain, folder / "again.glb")
    if report["dropped"]["duplicate_vertices"]:
        assert all(second[name] <= first[name] for name in first)
        assert second["triangles"] == first["triangles"] > 100
    else:
        assert first == second and first["triangles"] > 100


@pytest.mark.parametrize("name", REAL)
def test_real_files(blender, tmp_path, name):
    """Imported as they are, and exported again plain and compressed."""
    path = MODELS / f"{name}.glb"
    if not path.exists():
        missing(f"no {path}")
    assert blender("import_file", path) == ""
    assert_same(blender, tmp_path)


@pytest.mark.parametrize("name", ["CesiumMan_skinned", "Fox_skinned_unindexed", "tube"])
def test_rigged_meshes(blender, tmp_path, name):
    path = MODELS / "nasty" / f"{name}.glb"
    if name == "tube":
        blender("rigged_cylinder")
    elif not path.exists():
        missing(f"no {path}")
    else:
        assert blender("import_file", path) == ""
    assert_same(blender, tmp_path)


# Decimate breaks ties of a regular sphere by the last bits of positions.
@pytest.mark.parametrize(
    ("name", "kind"), [("ico", "SMOOTH"), ("igea", "SMOOTH"), ("igea", "DECIMATE")]
)
def test_modifiers_make_the_same(blender, tmp_path, name, kind):
    if name == "ico":
        blender("primitive", "ico_sphere", subdivisions=7)
    elif blender("import_file", MODELS / f"{name}.glb"):
        missing(f"no {name}.glb in {MODELS}")
    results = []
    for path in exported(blender, tmp_path):
        blender("import_file", path)
        results.append(blender("modified", kind, **MODIFIERS[kind]))
    (first,), (second,) = (list(result.values()) for result in results)
    assert first.pop("size") == pytest.approx(second.pop("size"), rel=1e-3)
    if kind == "DECIMATE":
        for name in ("vertices", "edges", "triangles"):
            assert first.pop(name) == pytest.approx(second.pop(name), abs=3)
    assert first == second
