"""Writes the options of `compress` into docs/cli.md and into its docstring.

python -m tools.option_docs: after an edit in gltf_ext/options.py. A test compares.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gltf_ext.options import OPTIONS, described

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


@dataclass
class Block:
    """Generated lines in a file, between two lines that stay."""

    path: Path
    before: str
    after: str
    generate: Callable[[], str]

    def current(self) -> str:
        """The text that the file has when its block is up to date. Raises ValueError."""
        head, before, rest = self.path.read_text().partition(self.before)
        _, after, tail = rest.partition(self.after)
        if not after:
            raise ValueError(f"{self.path}: no {self.before!r} followed by {self.after!r}")
        return head + before + self.generate() + after + tail


BLOCKS = (
    Block(ROOT / "docs" / "cli.md", "<!-- compress options -->\n", "<!-- end -->", markdown_block),
    Block(
        ROOT / "gltf_ext" / "commands" / "compress.py",
        "    Options:\n",
        "\n    Returns a report:\n",
        described,
    ),
)


if __name__ == "__main__":
    for block in BLOCKS:
        block.path.write_text(block.current())
