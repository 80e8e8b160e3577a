"""The report of a batch as one HTML page."""

from __future__ import annotations

import html
from typing import Any

from gltf_ext.errors import printable

STYLE = """
body { font: 14px/1.5 system-ui, sans-serif; margin: 2em; color: #222; background: #fff; }
table { border-collapse: collapse; }
th, td { padding: 4px 12px; text-align: right; border-bottom: 1px solid #ddd; }
th { position: sticky; top: 0; background: #fff; }
td:nth-child(2) { text-align: left; word-break: break-all; }
td.error { text-align: left; color: #b00020; }
small { color: #777; }
"""
HEADINGS = ("", "file", "input", "output", "times smaller", "triangles", "largest error", "seconds")


def page(report: dict[str, Any]) -> str:
    """Failures first. Names and messages are escaped."""
    totals = report["totals"]
    options = " ".join(f"{name}={value}" for name, value in report["options"].items())
    summary = (
        f"{totals['done']:,} done, {totals['unchanged']:,} unchanged, {totals['failed']:,} failed, "
        f"{len(report['left_out']):,} left out; "
        f"{totals['input_bytes']:,} bytes to {totals['output_bytes']:,}, "
        f"{totals['triangles']:,} triangles, in {report['seconds']:.1f} s"
    )
    left_out = "".join(
        f"<li>left out: {_text(item['path'])} {_text(item['reason'])}</li>\n"
        for item in report["left_out"]
    )
    version = f"gltf-meshlet {report['version']}{', ' + options if options else ''}"
    return f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>gltf-meshlet batch</title>
<style>{STYLE}</style>
<h1>{_text(report["source"])}</h1>
<p>{_text(summary)}<br><small>{_text(version)}</small></p>
<ul>
{left_out}</ul>
<table>
<tr>{"".join(f"<th>{heading}</th>" for heading in HEADINGS)}</tr>
{"".join(map(_row, report["files"]))}</table>
</html>
"""


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
    image = f'<img src="{picture}" alt="" width="96" height="96" loading="lazy">'
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
