"""Levels of detail at import: a level, an error, a proxy, objects."""

import pytest

import gltf_ext

pytestmark = pytest.mark.full


@pytest.fixture(scope="module")
def levels(tmp_path_factory, blender):
    """A file with levels, and the triangles of each."""
    folder = tmp_path_factory.mktemp("levels")
    blender("primitive", "ico_sphere", uv=False, subdivisions=6)
    plain, path = folder / "plain.glb", folder / "levels.glb"
    blender("export_open", plain, enabled=False)
    gltf_ext.compress(plain, path, lod=True)
    (lod,) = gltf_ext.inspect(path)["lod"]
    return path, lod["levels"]


def sphere(blender):
    (name,) = blender("objects")
    return blender("objects")[name]


@pytest.mark.parametrize("level", [0, 1, 2, 99])
def test_a_level(blender, levels, level):
    path, of_levels = levels
    assert blender("import_file", path, detail="LEVEL", level=level) == ""
    triangles = of_levels[min(level, len(of_levels) - 1)]["triangles"]
    assert sphere(blender)["triangles"] == triangles
    assert blender("topology")["boundary"] == 0


def test_an_error_in_millimetres(blender, levels):
    path, of_levels = levels
    millimetres = 1001 * of_levels[2]["error"]
    assert blender("import_file", path, detail="ERROR", error=millimetres) == ""
    assert sphere(blender)["triangles"] == of_levels[2]["triangles"]
    assert blender("topology")["boundary"] == 0


def test_a_proxy_is_in_the_viewport_only(blender, levels, tmp_path):
    path, of_levels = levels
    full, coarse = (of_levels[k]["triangles"] for k in (0, 2))
    assert blender("import_file", path, detail="PROXY", level=2) == ""
    item = sphere(blender)  # one object
    assert (item["triangles"], item["shown"]) == (full, coarse)
    assert list(blender("rendered").values()) == [full]
    blender("export_applied", tmp_path / "applied.glb")
    (exported,) = gltf_ext.load(tmp_path / "applied.glb")
    assert len(exported.indices) == full
    assert sphere(blender)["shown"] == coarse  # as before the export


def test_a_proxy_needs_no_extension(blender, levels, tmp_path):
    """The .blend file works where it is not installed."""
    path, of_levels = levels
    blender("import_file", path, detail="PROXY", level=1)
    blender("disable")
    try:
        blender("save_and_open", tmp_path / "a.blend")
        item = sphere(blender)
        assert item["triangles"] == of_levels[0]["triangles"]
        assert item["shown"] == of_levels[1]["triangles"]
    finally:
        blender("enable")


def test_a_proxy_moves_with_its_armature(blender, tmp_path):
    """And with shape keys, which a proxy cannot have, all triangles are shown."""
    blender("rigged_cylinder", rings=200)
    blender("export_open", tmp_path / "rigged.glb", lod=True)
    poses = []
    for detail in ("FULL", "PROXY"):
        assert blender("import_file", tmp_path / "rigged.glb", detail=detail, level=1) == ""
        items = blender("objects")
        assert [i["shown"] < i["triangles"] for i in items.values()] == [detail == "PROXY"]
        poses.append(blender("posed"))
    assert poses[0] == pytest.approx(poses[1], abs=0.02)
    blender("rigged_cylinder", rings=200, shape_key=True)
    blender("export_open", tmp_path / "keys.glb", lod=True)
    assert blender("import_file", tmp_path / "keys.glb", detail="PROXY", level=1) == ""
    assert all(i["shown"] == i["triangles"] for i in blender("objects").values())


def test_levels_are_objects_in_collections(blender, levels):
    path, of_levels = levels
    assert blender("import_file", path, detail="OBJECTS") == ""
    items = blender("objects")
    triangles = [item["triangles"] for item in items.values()]
    assert sorted(triangles, reverse=True) == [level["triangles"] for level in of_levels]
    first, *others = sorted(items, key=lambda name: -items[name]["triangles"])
    assert others == [f"{first}_LOD{k}" for k in range(1, len(of_levels))]
    assert [items[name]["collections"] for name in others] == [
        [f"LOD{k}"] for k in range(1, len(of_levels))
    ]
    assert not items[first]["hidden"] and all(items[name]["hidden"] for name in others)


def test_levels_of_objects_with_armatures_and_instances(blender, tmp_path):
    """Each object has its levels at its place; they share meshes as the objects do."""
    blender("rigged_cylinder", rings=200)
    blender("duplicate_objects", 3)
    blender("export_open", tmp_path / "in.glb", lod=True)
    assert blender("import_file", tmp_path / "in.glb", detail="OBJECTS") == ""
    items = blender("objects")
    first = [name for name in items if "_LOD" not in name]
    of_level_1 = [name for name in items if name.endswith("_LOD1")]
    assert len(of_level_1) == len(first) > 1
    assert {tuple(items[name]["modifiers"]) for name in items} == {("Armature",)}


def test_files_without_levels_say_so(blender, rich):
    for detail in ("LEVEL", "ERROR", "PROXY", "OBJECTS"):
        (message,) = blender("import_messages", rich, detail=detail)
        assert message == f"{rich.name} has no levels of detail: all triangles are imported"
        assert blender("contents")["objects"] == 1


def test_scaled_nodes_have_errors_of_the_scene(blender, tmp_path):
    blender("primitive", "ico_sphere", subdivisions=6)
    blender("scale_objects", 100.0)
    blender("export_open", tmp_path / "in.glb", lod=True)
    (lod,) = gltf_ext.inspect(tmp_path / "in.glb")["lod"]
    millimetres = 1001 * 100 * lod["levels"][2]["error"]
    assert blender("import_file", tmp_path / "in.glb", detail="ERROR", error=millimetres) == ""
    assert sphere(blender)["triangles"] == lod["levels"][2]["triangles"]
