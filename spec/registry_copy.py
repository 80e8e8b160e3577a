"""Writes the folders of all extensions as glTF's registry wants them, under a vendor prefix.

    python -m spec.registry_copy PREFIX FOLDER

FOLDER/PREFIX_meshlet_edgebreaker, FOLDER/PREFIX_meshlet_lod and FOLDER/PREFIX_meshlet_transport get
a README.md and the JSON schema. spec/registration.md says what else a registration needs.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
# Name -> the object of glTF that has the extension.
NAMES = {
    "meshlet_edgebreaker": "mesh.primitive",
    "meshlet_lod": "mesh.primitive",
    "meshlet_transport": "bufferView",
}
PREFIX = re.compile(r"[A-Z0-9]+")


def under_prefix(text: str, prefix: str) -> str:
    """Renames the extensions, also where Markdown escapes the underscores."""
    return re.sub(r"\bEXT(?=\\?_meshlet)", prefix, text)


def readme(name: str, prefix: str) -> str:
    """The document with links that hold in the registry."""
    text = (HERE / f"EXT_{name}.md").read_text()
    text = re.sub(r"\[([^\]]+)\]\((?:lod_|transport_)?vectors/[^)]*\)", r"`\1`", text)
    text = re.sub(r"\(EXT_(\w+)\.md(#[^)]*)?\)", r"(../EXT_\1/README.md\2)", text)
    text = re.sub(r"<!-- .*: (?:written|begin|end).*-->\n|<!-- (?:begin|end) .*-->\n", "", text)
    text = text.replace("beside this document", "in the repository of gltf-meshlet")
    return under_prefix(text, prefix)


def files(prefix: str) -> dict[str, str]:
    """Path -> content of all files. Raises ValueError for a prefix that is no name."""
    if not PREFIX.fullmatch(prefix) or prefix in ("EXT", "KHR"):
        raise ValueError(f"{prefix} is no vendor prefix: it needs capital letters and digits")
    result = {}
    for name, place in NAMES.items():
        schema = f"{place}.EXT_{name}.schema.json"
        folder = f"{prefix}_{name}"
        result[f"{folder}/README.md"] = readme(name, prefix)
        text = (HERE / "schema" / schema).read_text()
        result[f"{folder}/schema/{under_prefix(schema, prefix)}"] = under_prefix(text, prefix)
    return result


def main() -> None:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    for path, text in files(sys.argv[1]).items():
        target = Path(sys.argv[2]) / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text)


if __name__ == "__main__":
    main()
