"""Documentation: links and anchors exist, commands and flags are real, Python examples run."""

import ast
import importlib.util
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import trimesh

from gltf_meshlet import cli
from gltf_meshlet.demo import model
from tests.helpers.environment import need_package

ROOT = Path(__file__).resolve().parent.parent.parent
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(ROOT.glob("docs/*.md")),
    ROOT / "spec" / "EXT_meshlet_edgebreaker.md",
]
COMMANDS = (
    "compress",
    "batch",
    "decompress",
    "transcode",
    "inspect",
    "verify",
    "validate",
    "render",
    "view",
    "gpu-check",
    "demo",
)
FLAG = re.compile(r"(?<![\w-])--?[a-z][a-z-]*")
LINK = re.compile(r"\]\(([^)\s]+)\)")


def page_name(path):
    return path.relative_to(ROOT).as_posix()


def without_code(text):
    return re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.DOTALL)


def code_lines(text):
    """Lines of fenced and of indented code blocks."""
    for block in re.findall(
        r"```[a-z]*\n(.*?)```|((?:^ {4}.*\n)+)", text, re.DOTALL | re.MULTILINE
    ):
        yield from "".join(block).splitlines()


def help_of(command, capsys):
    with pytest.raises(SystemExit):
        cli.main([command, "--help"])
    return capsys.readouterr().out


# --- links ---


def anchors(path):
    """As GitHub makes them: lower case, punctuation dropped, spaces to hyphens."""
    headings = re.findall(
        r"^#+ (.*)$", re.sub(r"```.*?```", "", path.read_text(), flags=re.S), re.M
    )
    plain = [re.sub(r"[`*\\]|\]\([^)]*\)|\[", "", heading).strip().lower() for heading in headings]
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_relative_links_and_anchors_exist(page):
    for link in LINK.findall(without_code(page.read_text())):
        if link.startswith("https://"):
            continue
        target, _, anchor = link.partition("#")
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), link
        assert not anchor or anchor in anchors(path), link


def test_every_page_is_in_the_navigation():
    navigation = (ROOT / "mkdocs.yml").read_text().partition("\nnav:\n")[2]
    for page in ROOT.glob("docs/*.md"):
        assert f": {page.name}\n" in navigation, page.name


def test_index_lists_every_page():
    linked = set(LINK.findall((ROOT / "docs" / "index.md").read_text()))
    assert {page.name for page in ROOT.glob("docs/*.md")} - linked == {"index.md"}


def test_every_picture_is_shown():
    shown = {Path(link).name for page in PAGES for link in LINK.findall(page.read_text())}
    assert {path.name for path in ROOT.glob("docs/*.png")} <= shown


PATH = re.compile(
    r"`((?:bench|codec|docs|gltf_ext|gltf_meshlet|gltf_scene|mitsuba_plugin|shaders|spec|tests|tools"
    r"|vk_backend)/[^`\s]*)`"
)


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_paths_in_backticks_exist(page):
    """Files and folders of the repository; * matches any name, NAME stands for one."""
    for path in PATH.findall(page.read_text()):
        assert list(ROOT.glob(path.replace("NAME", "*").rstrip("/"))), path


# --- commands ---


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_commands_in_code_blocks_are_known(page, capsys):
    for line in code_lines(page.read_text()):
        words = shlex.split(line.split("#")[0]) if line.strip().startswith("gltf-meshlet ") else []
        if not words or words[1] in ("COMMAND", "--version"):
            continue
        assert words[1] in COMMANDS, line
        usage = help_of(words[1], capsys)
        for word in words[2:]:
            for flag in FLAG.findall(word if word.startswith(("-", "[-")) else ""):
                assert re.search(rf"(?<![\w-]){flag}(?![\w-])", usage), line


def test_commands_of_the_tutorial_run(tmp_path, monkeypatch, capsys):
    """In their order, on a generated scan; all but the one that opens a browser."""
    need_package("meshoptimizer")
    monkeypatch.chdir(tmp_path)
    scan = trimesh.creation.icosphere(subdivisions=5)
    scan.visual.vertex_colors = np.uint8(np.abs(scan.vertices) * 255)
    scan.export("scan.ply")
    lines = code_lines((ROOT / "docs" / "tutorial.md").read_text())
    commands = [shlex.split(line) for line in lines if "--original" not in line]
    assert len(commands) == 8
    for name, *arguments in commands:
        assert name == "gltf-meshlet"
        assert cli.main(arguments) == 0, capsys.readouterr().err
    sizes = [Path(name).stat().st_size for name in ("scan.ply", "exact.glb", "scan.glb")]
    assert sizes == sorted(sizes, reverse=True)
    assert Path("packed.glb").stat().st_size < sizes[-1]
    assert len(trimesh.load("plain.glb", force="mesh").faces) == len(scan.faces)
    assert 0 < len(trimesh.load("small.glb", force="mesh").faces) < len(scan.faces) / 4
    assert Path("site", "index.html").exists()


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_make_targets_exist(page):
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    text = page.read_text()
    named = re.findall(r"`make ([a-z-]+)`", text)
    named += [m[1] for line in code_lines(text) if (m := re.match(r" *make ([a-z-]+)", line))]
    assert set(named) <= targets, sorted(set(named) - targets)


def test_readme_shows_how_to_start():
    readme = (ROOT / "README.md").read_text()
    shown = ["make demo", "make test", *(f"gltf-meshlet {name} " for name in COMMANDS[:-1])]
    assert [command for command in shown if f"\n{command}" not in readme] == []


@pytest.mark.parametrize("command", COMMANDS)
def test_manual_has_every_flag_of_a_command_and_no_other(command, capsys):
    manual = (ROOT / "docs" / "cli.md").read_text()
    sections = dict(re.findall(r"^## ([\w-]+)\n(.*?)(?=^## |\Z)", manual, re.DOTALL | re.MULTILINE))
    section = sections[command]
    if "| all of [`compress`](#compress) |" in section:
        section += sections["compress"]
    listed = re.findall(r"^\| (`.*?) \|", section, re.M)
    documented = {flag for cell in listed for flag in FLAG.findall(cell)}
    usage = help_of(command, capsys)
    options = re.findall(r"^ {2,}(-[^ ].*)$", usage, re.M)
    real = {f for line in options for f in FLAG.findall(re.split(r" {2,}", line)[0])}
    assert documented == real - {"-h", "--help"}


def test_manual_lists_every_command(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    real = re.findall(r"^ {4}([a-z-]+)\b", capsys.readouterr().out, re.M)
    manual = (ROOT / "docs" / "cli.md").read_text()
    assert tuple(real) == COMMANDS
    assert tuple(re.findall(r"^## (.*)$", manual, re.M)) == COMMANDS


# --- Python ---


def python_blocks(page):
    return re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)


def needs_renderer(block):
    return re.search(r"mitsuba|vk_backend", block) is not None


@pytest.mark.parametrize("name", ["README.md", "docs/python.md"])
def test_python_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model.write_glb(model.generate(), "bunny.glb")
    Path("plain-text.glb").write_text("not a glTF file")
    namespace = {}
    blocks = [block for block in python_blocks(ROOT / name) if not needs_renderer(block)]
    assert blocks
    for block in blocks:
        exec(compile(block, name, "exec"), namespace)


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_python_examples_import_names_that_exist(page):
    """Also of renderers that are not installed: their modules are read, not imported."""
    for block in python_blocks(page):
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.ImportFrom):
                source = module_file(node.module).read_text()
                for alias in node.names:
                    assert re.search(rf"\b{alias.name}\b", source), f"{node.module}.{alias.name}"


def module_file(name):
    path = ROOT.joinpath(*name.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


# --- the site ---


def test_api_reference_has_every_public_name():
    spec = importlib.util.spec_from_file_location("docs_hooks", ROOT / "tools" / "docs_hooks.py")
    hooks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hooks)
    for package in ("gltf_ext", "vk_backend"):
        assert set(hooks.API[package]) == set(importlib.import_module(package).__all__)
    tree = ast.parse((ROOT / "mitsuba_plugin" / "__init__.py").read_text())
    exported = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
    )
    assert set(hooks.API["mitsuba_plugin"]) == set(exported)
    for package, names in hooks.API.items():
        for name in names:
            hooks.definition(package, name)
