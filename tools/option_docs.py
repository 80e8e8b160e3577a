"""Writes the options of `compress` into docs/cli.md and into the docstring of `compress`.

python -m tools.option_docs: after an edit in gltf_ext/compression/options.py. A test compares.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

from gltf_ext.compression.options import OPTIONS, Option

ROOT = Path(__file__).resolve().parent.parent
WIDTH = 100


def docstring_block() -> str:
    """The options as `compress`'s docstring has them, each with its Python name."""
    return "".join(
        textwrap.fill(
            f"{option.name}: {_with_choices(option)}.",
            WIDTH,
            initial_indent=" " * 8,
            subsequent_indent=" " * 12,
        )
        + "\n"
        for option in OPTIONS
    )


def _with_choices(option: Option) -> str:
    choices = f'"{choices}": ' if (choices := '" or "'.join(option.choices)) else ""
    return choices + option.text


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


# (file, line before the block, line after it, block)
BLOCKS = (
    (
        ROOT / "gltf_ext" / "commands" / "compress.py",
        "    Options:\n",
        "\n    Returns",
        docstring_block,
    ),
    (ROOT / "docs" / "cli.md", "<!-- compress options -->\n", "<!-- end -->", markdown_block),
)


def written(text: str, before: str, after: str, block: str) -> str:
    """The text with everything between `before` and `after` replaced by the block."""
    head, _, rest = text.partition(before)
    _, found, tail = rest.partition(after)
    if not found:
        raise ValueError(f"no {before.strip()!r} followed by {after.strip()!r}")
    return head + before + block + found + tail


if __name__ == "__main__":
    for path, before, after, block in BLOCKS:
        path.write_text(written(path.read_text(), before, after, block()))
