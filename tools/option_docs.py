"""Writes the options of `compress` into docs/cli.md.

python -m tools.option_docs: after an edit in gltf_ext/compression/options.py. A test compares.
"""

from __future__ import annotations

from pathlib import Path

from gltf_ext.compression.options import OPTIONS

ROOT = Path(__file__).resolve().parent.parent


def markdown_block() -> str:
    """The table of the manual."""
    rows = [
        "| command line | Python | meaning | values | default |",
        "| --- | --- | --- | --- | --- |",
    ]
    for option in OPTIONS:
        flag = f"`{option.flag} {option.metavar or ''}".rstrip() + "`" if option.flag else ""
        values = option.limits_text or ", ".join(f"`{choice}`" for choice in option.choices)
        cells = (flag, f"`{option.name}`", option.help, values, option.default)
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


PAGE, BEFORE, AFTER = ROOT / "docs" / "cli.md", "<!-- compress options -->\n", "<!-- end -->"


def written(text: str) -> str:
    """The text of the manual with everything between BEFORE and AFTER replaced by the table."""
    head, _, rest = text.partition(BEFORE)
    _, found, tail = rest.partition(AFTER)
    if not found:
        raise ValueError(f"no {BEFORE.strip()!r} followed by {AFTER!r}")
    return head + BEFORE + markdown_block() + found + tail


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text()))
