"""Who may import whom: every package only imports from the layers below it."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
# Package -> the packages of this project that it may import.
ALLOWED = {
    "gltf_ext": set(),
    "mitsuba_plugin": {"gltf_ext"},
    "vk_backend": {"gltf_ext"},
    "gltf_meshlet": {"gltf_ext", "mitsuba_plugin", "vk_backend"},
    "blender": {"gltf_ext"},
    "spec": {"gltf_ext"},
    "tools": {"gltf_ext"},
    "bench": {"gltf_ext", "mitsuba_plugin", "vk_backend", "gltf_meshlet", "spec", "tools"},
}
# The same inside gltf_ext; what belongs to no folder is below both, but for these.
FOLDERS = {"gltf": {"compression", "lod"}, "compression": set(), "lod": set()}
ABOVE_FOLDERS = {"__init__", "trimesh_handler"}
OURS = {*ALLOWED, "tests"}


def modules_of(package):
    return sorted((ROOT / package).rglob("*.py"))


def imported(path):
    """Absolute names of all modules that a file imports, inside functions too."""
    parts = list(path.relative_to(ROOT).with_suffix("").parts)
    package = parts[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *filter(None, [node.module])])
            yield from (f"{module}.{alias.name}" for alias in node.names)


def problems_of(path, allowed):
    own = path.relative_to(ROOT).parts[0]
    used = {name.partition(".")[0] for name in imported(path)} & OURS
    return [f"{path.relative_to(ROOT)} imports {name}" for name in used - allowed - {own}]


@pytest.mark.parametrize("package", ALLOWED)
def test_packages_import_only_from_below(package):
    paths = modules_of(package)
    assert paths
    problems = [problem for path in paths for problem in problems_of(path, ALLOWED[package])]
    assert problems == []


@pytest.mark.parametrize("folder", FOLDERS)
def test_folders_of_gltf_ext_import_only_from_below(folder):
    for path in modules_of(f"gltf_ext/{folder}"):
        for name in imported(path):
            parts = name.split(".")
            if parts[0] == "gltf_ext" and len(parts) > 1:
                assert parts[1] not in FOLDERS[folder] | ABOVE_FOLDERS, f"{path} imports {name}"


def test_modules_below_both_folders_import_neither():
    for path in (ROOT / "gltf_ext").glob("*.py"):
        if path.stem in ABOVE_FOLDERS:
            continue
        for name in imported(path):
            assert not name.startswith(("gltf_ext.gltf", "gltf_ext.compression")), path


def test_imports_are_found():
    """The test above can fail: relative and nested imports are seen."""
    module = ROOT / "gltf_ext" / "compression" / "loading.py"
    assert "gltf_ext.gltf.importers.open_model" in set(imported(module))
    cli = ROOT / "gltf_meshlet" / "cli.py"
    assert "gltf_meshlet.demo.run" in set(imported(cli)), "an import inside a function"
    assert problems_of(cli, set()) == ["gltf_meshlet/cli.py imports gltf_ext"]


def test_the_demo_does_not_import_the_command_line():
    for path in modules_of("gltf_meshlet/demo"):
        assert not any(name.startswith("gltf_meshlet.cli") for name in imported(path)), path
