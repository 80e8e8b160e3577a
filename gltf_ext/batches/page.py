"""The report of a batch as one HTML page."""

from __future__ import annotations

import html
from collections.abc import Iterator
from typing import Any

from gltf_ext.batches.storage import STATE
from gltf_ext.errors import printable

ROWS = 500  # of a page: a browser shows it at once, with its pictures
STYLE = """
body { font: 14px/1.5 system-ui, sans-serif; margin: 2em; color: #222; background: #fff; }
table { border-collapse: collapse; }
th, td { padding: 4px 12px; text-align: right; border-bottom: 1px solid #ddd; }
th { position: sticky; top: 0; background: #fff; }
th:nth-child(2), td:nth-child(2) { text-align: left; }
td:nth-child(2) { word-break: break-all; }
td.error { text-align: left; color: #b00020; }
nav a, nav b { margin-right: 0.6em; }
small { color: #777; }
"""
HEADINGS = ("", "file", "input", "output", "times smaller", "triangles", "largest error", "seconds")


def pages(report: dict[str, Any], first: str) -> Iterator[tuple[str, str]]:
    """Yield (name in the destination, text) of the pages: the first one has this name."""
    count = page_count(report)
    for number in range(count):
        yield page_name(first, number), page(report, first, number, count)


def page_count(report: dict[str, Any]) -> int:
    """Return the number of pages."""
    return max(1, -(-len(report["files"]) // ROWS))


def page_name(first: str, number: int) -> str:
    """Return the name of a page in the destination; the first has the number 0."""
    return first if number == 0 else f"{STATE}/page-{number + 1}.html"


def page(report: dict[str, Any], first: str = "", number: int = 0, count: int = 1) -> str:
    """Return one of several pages. Failures come first. Names and messages are escaped."""
    version = f"gltf-meshlet {report['version']}"
    options = [f"{name}={value}" for name, value in report["options"].items()]
    rows = report["files"][number * ROWS : (number + 1) * ROWS]
    links = _links(first, number, count)
    return f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>gltf-meshlet batch</title>
<style>{STYLE}</style>
<h1>{_text(report["source"])}</h1>
<p>{_text(_summary(report))}<br><small>{_text(", ".join([version, *options]))}</small></p>
{links}{_remarks(report) if number == 0 else ""}<table>
<tr>{"".join(f"<th>{heading}</th>" for heading in HEADINGS)}</tr>
{"".join(map(_row, rows))}</table>
{links}</html>
"""


def _summary(report: dict[str, Any]) -> str:
    totals = report["totals"]
    stopped = f"Stopped: {report['stopped']}. " if report["stopped"] else ""
    return (
        f"{stopped}{totals['done']:,} done, {totals['unchanged']:,} unchanged, "
        f"{totals['failed']:,} failed, {totals['left_out']:,} left out; "
        f"{totals['input_bytes']:,} bytes to {totals['output_bytes']:,}, "
        f"{totals['triangles']:,} triangles, in {report['seconds']:.1f} s"
    )


def _remarks(report: dict[str, Any]) -> str:
    """Return a list of what has no row."""
    lines = [f"left out: {item['path']} {item['reason']}" for item in report["left_out"]]
    lines += [f"removed, its model is gone: {name}" for name in report["removed"]]
    remaining = set(report["gone"]) - set(report["removed"])
    lines += [f"its model is gone: {name}" for name in sorted(remaining)]
    return f"<ul>\n{''.join(f'<li>{_text(line)}</li>{chr(10)}' for line in lines)}</ul>\n"


def _links(first: str, number: int, count: int) -> str:
    """Return the links between pages; empty for a single one."""
    if count == 1:
        return ""
    start = "../" * (number > 0)
    links = (
        f"<b>{i + 1}</b>" if i == number else f'<a href="{start}{page_name(first, i)}">{i + 1}</a>'
        for i in range(count)
    )
    return f"<nav>Page {' '.join(links)}</nav>\n"


def _text(text: str) -> str:
    """Escaped. Names may hold control characters, and on a disk bytes that are no text."""
    return html.escape(printable(text))


def _row(file: dict[str, Any]) -> str:
    name = _text(file["name"])
    if file["status"] == "failed":
        error = _text(file["error"])
        return f'<tr><td></td><td>{name}</td><td class="error" colspan="6">{error}</td></tr>\n'
    warnings = "".join(f"<br><small>{_text(line)}</small>" for line in file["warnings"])
    error = file["max_error_percent"]
    picture = f"data:image/png;base64,{_text(file['thumbnail'])}"
    image = f'<img src="{picture}" alt="" width="64" height="64" loading="lazy">'
    cells = (
        image if file["thumbnail"] else "",
        f"{name}{warnings}",
        f"{file['input_bytes']:,}",
        f"{file['output_bytes']:,}",
        f"{file['input_bytes'] / file['output_bytes']:.2f}",
        f"{file['triangles']:,}",
        "" if error is None else f"{error:.3g} %",
        f"{file['seconds']:.1f}" + (" <small>before</small>" * (file["status"] != "done")),
    )
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>\n"
