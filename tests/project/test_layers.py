"""Who may import whom: packages and folders import only from the layers below, never in a circle.

Imports inside functions and those for type checkers count as all others.
"""

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
# Package -> the packages of this project that it may import.
ALLOWED = {
    "gltf_ext": set(),
    "gltf_scene": {"gltf_ext"},
    "mitsuba_plugin": {"gltf_ext", "gltf_scene"},
    "vk_backend": {"gltf_ext", "gltf_scene"},
    "gltf_meshlet": {"gltf_ext", "gltf_scene", "mitsuba_plugin", "vk_backend"},
    "blender": {"gltf_ext"},
    "spec": {"gltf_ext", "tools"},  # the encoder of the vectors
    "tools": {"gltf_ext"},
    "bench": {
        *("gltf_ext", "gltf_scene", "mitsuba_plugin", "vk_backend", "gltf_meshlet"),
        *("spec", "tools"),
    },
}
OURS = {*ALLOWED, "tests"}
MODULE_NAME = re.compile(rf"({'|'.join(ALLOWED)})(\.\w+)+")  # given to import_module
# The layers of gltf_ext, from below: each imports only itself and those before it.
LAYERS = (
    {
        "errors",
        "files",
        "options",
        "portable",
        "progress",
        "ranges",
        "scheduler",
        "work_files",
        "_codec",
        "_joinable",
        "_library",
        "_replacement_errors",
    },
    {"document"},
    {"sources"},
    {"attributes"},
    {"lod"},
    {"encode"},
    {"checks"},
    {"commands"},
    {"batches"},
    {"__init__", "trimesh_handler"},
)
# Those of vk_backend.
VULKAN_LAYERS = (
    {"gpu"},
    {"scene"},
    {"decode"},
    {"levels"},
    {"raster"},
    {"visibility"},
    {"raytrace"},
    {"frame_commands"},
    {"renderer"},
    {"check"},
    {"command"},
    {"__init__"},
)
# Where a file with this suffix names others of ours, and how.
INCLUDES = {
    **dict.fromkeys((".h", ".cpp", ".glsl"), re.compile(r'^#include "([^"]+)"', re.M)),
    **dict.fromkeys((".js", ".mjs"), re.compile(r"""\b(?:from|import) ?\(?['"](\.[^'"]+)""")),
}
INCLUDE_FOLDERS = ("codec", "mitsuba_plugin/src", "shaders", "web")


def modules_of(package):
    return sorted((ROOT / package).rglob("*.py"))


def imported(path):
    """Absolute names of all modules that a file imports, inside functions and by name too."""
    parts = list(path.relative_to(ROOT).with_suffix("").parts)
    package = parts[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Constant) and MODULE_NAME.fullmatch(str(node.value)):
            if (ROOT / f"{node.value.replace('.', '/')}.py").is_file():
                yield node.value
        elif isinstance(node, ast.Import):
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


def listed_in_pyproject(key):
    """The names of a list in pyproject.toml (Python 3.10 has no reader of TOML)."""
    text = (ROOT / "pyproject.toml").read_text()
    (names,) = re.findall(rf"^{re.escape(key)} = \[(.*?)\]", text, re.M | re.S)
    return re.findall(r'"([^"]+)"', names)


def test_every_package_is_in_the_wheel_and_typed_and_has_its_layer():
    """A package that others import at run time cannot stay out of one of the lists."""
    wheel = listed_in_pyproject("wheel.packages")
    assert {path.parent.name for path in ROOT.glob("*/__init__.py")} <= OURS
    assert wheel == listed_in_pyproject("packages")
    for package in wheel:
        assert set(wheel) >= ALLOWED[package], f"what {package} imports is not in the wheel"


def layer_problems(path, package="gltf_ext", layers=LAYERS):
    """Imports of a module of a package that are not from below."""
    number = {name: i for i, names in enumerate(layers) for name in names}
    own = path.relative_to(ROOT / package).with_suffix("").parts[0]
    for name in imported(path):
        of, _, rest = name.partition(".")
        if of == package:
            other = rest.partition(".")[0]
            if number.get(other, 0 if other.startswith("__") else len(layers)) > number[own]:
                yield f"{path.relative_to(ROOT)} imports {name}"


def test_folders_of_gltf_ext_import_only_from_below():
    problems = [problem for path in modules_of("gltf_ext") for problem in layer_problems(path)]
    assert problems == []


def test_folders_of_vk_backend_import_only_from_below():
    problems = [
        problem
        for path in modules_of("vk_backend")
        for problem in layer_problems(path, "vk_backend", VULKAN_LAYERS)
    ]
    assert problems == []


def test_gpu_knows_nothing_of_gltf():
    """The folder takes from other packages only errors, and how files are written."""
    used = {name for path in modules_of("vk_backend/gpu") for name in imported(path)}
    ours = {name for name in used if name.partition(".")[0] in OURS}
    assert {name for name in ours if not name.startswith("vk_backend.gpu")} == {
        "gltf_ext.errors.MeshletError",
        "gltf_ext.files.cache_folder",
        "gltf_ext.files.write_files",
    }


def test_imports_are_found(tmp_path, monkeypatch):
    """The tests above can fail: imports in functions, by name and for type checkers are seen."""
    cli = ROOT / "gltf_meshlet" / "cli.py"
    assert "gltf_meshlet.demo.run" in set(imported(cli)), "import_module in a function"
    assert "gltf_ext.options.FLAGS" in set(imported(cli)), "an import in a function"
    assert problems_of(cli, set()) == ["gltf_meshlet/cli.py imports gltf_ext"]
    module = tmp_path / "gltf_ext" / "lod" / "cuts.py"
    module.parent.mkdir(parents=True)
    module.write_text(
        "from gltf_ext.attributes import streams\n"
        "from .tables import Tables\n"
        "if TYPE_CHECKING:\n    from gltf_ext.commands.compress import Job\n"
    )
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    assert list(layer_problems(module)) == [
        "gltf_ext/lod/cuts.py imports gltf_ext.commands.compress.Job"
    ]
    module = tmp_path / "vk_backend" / "gpu" / "memory.py"
    module.parent.mkdir(parents=True)
    module.write_text("from .device import Device\nfrom ..scene.scene import Scene\n")
    assert list(layer_problems(module, "vk_backend", VULKAN_LAYERS)) == [
        "vk_backend/gpu/memory.py imports vk_backend.scene.scene.Scene"
    ]


def test_the_demo_does_not_import_the_command_line():
    for path in modules_of("gltf_meshlet/demo"):
        assert not any(name.startswith("gltf_meshlet.cli") for name in imported(path)), path


# --- circles ---


def python_graph():
    """Module -> the modules that it imports, of all packages."""
    paths = [path for package in ALLOWED for path in modules_of(package)]
    names = {}
    for path in paths:
        parts = path.relative_to(ROOT).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path

    def module(name):
        """The module that defines an imported name; None for one that is not ours."""
        while name and name not in names:
            name = name.rpartition(".")[0]
        return name

    return {
        name: {m for n in imported(path) if n != "gltf_ext._codec" and (m := module(n))} - {name}
        for name, path in names.items()
    }


def include_graph():
    """C++, GLSL, JavaScript: file without suffix -> those that it includes."""
    paths = [
        path
        for folder in INCLUDE_FOLDERS
        for path in sorted((ROOT / folder).rglob("*"))
        if path.suffix in INCLUDES
    ]
    units = {path: str(path.relative_to(ROOT).with_suffix("")) for path in paths}
    graph = {unit: set() for unit in units.values()}
    for path, unit in units.items():
        for name in INCLUDES[path.suffix].findall(path.read_text()):
            places = [path.parent, *(ROOT / folder for folder in INCLUDE_FOLDERS)]
            found = [(place / name).resolve() for place in places]
            graph[unit] |= {units[other] for other in found if other in units} - {unit}
    return graph


def circle_in(graph):
    """The modules of an import circle in their order; empty if there is none."""
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node) :]
        if node in done:
            return []
        path.append(node)
        for other in sorted(graph[node]):
            if circle := visit(other):
                return circle
        done.add(path.pop())
        return []

    return next(filter(None, map(visit, sorted(graph))), [])


def test_no_modules_import_each_other_in_a_circle():
    graph = python_graph()
    assert "gltf_ext.errors" in graph["gltf_ext.commands.compress"]
    assert circle_in(graph) == []


def test_no_sources_include_each_other_in_a_circle():
    graph = include_graph()
    assert "codec/common/weld" in {name for used in graph.values() for name in used}
    assert "web/blob" in graph["web/pool"]
    assert circle_in(graph) == []


def test_circles_are_found():
    assert circle_in({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c"]
    assert circle_in({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


@pytest.mark.parametrize("package", ["gltf_ext", "gltf_ext.lod"])
def test_every_public_name_can_be_imported(package):
    module = importlib.import_module(package)
    for name in module.__all__:
        assert getattr(module, name) is not None
