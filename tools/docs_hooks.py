"""Hooks of mkdocs.yml: pages that are not in docs/, and links between them.

docs/ links to README.md, CONTRIBUTING.md, spec/ and other files of the repository, and they link to
docs/, as GitHub wants it: relative to the file. The site takes over every such file that a page
links to, under its path in the repository, and makes the links relative to that. The API reference
is generated from the docstrings, without importing the packages.
"""

from __future__ import annotations

import ast
import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
# Pages from outside docs/. What they link to follows by itself.
PAGES = ("README.md", "CONTRIBUTING.md", "spec/EXT_meshlet_edgebreaker.md")
# mkdocs would make README.md the index, which docs/index.md is.
RENAMED = {"README.md": "overview.md"}
# The public names of each package, in the order of the reference.
API = {
    "gltf_ext": (
        "compress",
        "batch",
        "decompress",
        "inspect",
        "verify",
        "validate",
        "load",
        "compress_warnings",
        "steps_text",
        "transcode",
        "Primitive",
        "decoders",
        "MeshletDecoder",
        "MeshletError",
        "NothingToCompress",
    ),
    "mitsuba_plugin": ("load_scene", "scene_dict", "statistics"),
    "vk_backend": (
        "load_scene",
        "Camera",
        "Renderer",
        "RayTracer",
        "Picture",
        "VulkanError",
    ),
}
# A link or an image: "](", then the target up to ")" or "#".
LINK = re.compile(r"(\]\()(?!https?://|mailto:|#)([^)#\s]+)")
CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)


def on_files(files, config):
    """Adds the pages from outside docs/, the files that they link to, and the API reference."""
    from mkdocs.structure.files import File

    known = {file.src_uri for file in files}
    waiting = [ROOT / page for page in PAGES]
    while waiting:
        path = waiting.pop()
        uri = site_path(path)
        if uri not in known:
            known.add(uri)
            files.append(File.generated(config, uri, abs_src_path=str(path)))
        if path.suffix == ".md":
            targets = linked_files(path)
            waiting += [t for t in targets if t.is_file() and site_path(t) not in known]
    for path in DOCS.glob("*.md"):
        for target in linked_files(path):
            uri = site_path(target)
            if target.is_file() and uri not in known:
                known.add(uri)
                files.append(File.generated(config, uri, abs_src_path=str(target)))
    for package, names in API.items():
        page = api_page(package, names)
        files.append(File.generated(config, f"api/{package}.md", content=page))
    return files


def on_page_markdown(markdown, page, config, files):
    """Links relative to the file in the repository become links relative to the page."""
    if page.file.src_uri.startswith("api/"):
        return markdown
    source = Path(page.file.abs_src_path)

    def relative(match: re.Match) -> str:
        target = site_path((source.parent / match[2]).resolve())
        return match[1] + os.path.relpath(target, os.path.dirname(page.file.src_uri) or ".")

    parts = CODE.split(markdown)
    parts[::2] = [LINK.sub(relative, part) for part in parts[::2]]
    return "".join(parts)


def linked_files(path: Path) -> list[Path]:
    """The files of the repository that a page links to, whether they exist or not."""
    text = CODE.sub("", path.read_text())
    return [(path.parent / match[2]).resolve() for match in LINK.finditer(text)]


def site_path(path: Path) -> str:
    """Of a file, below the site: docs/ is the site's root, other files keep their path."""
    base = DOCS if path.is_relative_to(DOCS) else ROOT
    uri = path.relative_to(base).as_posix()
    return RENAMED.get(uri, uri)


def api_page(package: str, names: tuple[str, ...]) -> str:
    """Markdown with a directive of mkdocstrings for each public name of a package."""
    directives = "".join(f"\n::: {definition(package, name)}\n" for name in names)
    return f"# {package}\n\nAll names are imported from `{package}`.\n{directives}"


def definition(package: str, name: str) -> str:
    """The dotted path of a public name: from __init__.py's imports, or its table of lazy ones."""
    tree = ast.parse((ROOT / package / "__init__.py").read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and name in {alias.name for alias in node.names}:
            return f"{package}.{(node.module or '').removeprefix(package + '.')}.{name}"
        if isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values):
                if isinstance(key, ast.Constant) and key.value == name:
                    return f"{package}.{ast.literal_eval(value)}.{name}"
    raise ValueError(f"{package}/__init__.py does not say where {name} is defined")
