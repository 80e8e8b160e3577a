"""The reports of gltf_ext as the command line prints them."""

from __future__ import annotations

import math
import os
from typing import Any

from gltf_ext.errors import printable

MAX_PRIMITIVES = 10
LABEL_WIDTH, NAME_WIDTH = 26, 20  # characters

Report = dict[str, Any]


def size(count: int) -> str:
    """Bytes in the unit that fits."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= factor:
            return f"{count / factor:.{1 if unit == 'kB' else 2}f} {unit}"
    return f"{count} B"


def plural(count: int, noun: str) -> str:
    """1 triangle, 2 triangles"""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def sizes(report: Report) -> str:
    """in.obj (1 MB) -> out.glb (9 kB), of a report of compress or decompress."""
    source, result = (
        f"{printable(os.path.basename(report[side]))} ({size(report[side + '_bytes'])})"
        for side in ("input", "output")
    )
    fallback = (
        f"{printable(name)} ({size(n)})" for name, n in report.get("fallback_files", {}).items()
    )
    return f"{source} -> {' + '.join([result, *fallback])}"


# --- compress ---


def _joined_text(report: Report) -> str:
    """Vertices that are one now: of triangles that had none in common, or read in parts."""
    count = report["dropped"]["duplicate_vertices"]
    return f"; {count:,} equal vertices joined" if count else ""


def compress_summary(report: Report) -> str:
    """One line on the result of compress."""
    totals = report["totals"]
    mean = f"{totals['mean_triangles_per_meshlet']:.1f} on average"
    parts = f"{plural(totals['meshlets'], 'meshlet')} ({mean})"
    distinct = [p for p in report["primitives"] if "shares_buffer_view_of" not in p]
    if totals["blobs"] > len(distinct):
        parts += f" and {plural(totals['blobs'], 'page')}"
    if "lod" in report:
        levels = max(len(primitive["triangles"]) for primitive in report["lod"])
        parts += f", {plural(levels, 'level')} of detail"
    return (
        f"{sizes(report)}, {report['input_bytes'] / report['output_bytes']:.2f} times smaller; "
        f"geometry {totals['ratio']:.2f} times smaller than raw floats, "
        f"{totals['bits_per_triangle']['total']:.2f} bits per triangle, "
        f"{plural(totals['triangles'], 'triangle')} in {parts}{_joined_text(report)}"
    )


def steps_line(report: Report) -> str:
    """The steps of the attributes, in one line."""
    from gltf_ext import steps_text  # --help is quicker without

    return steps_text(report["steps"])


# --- inspect ---


def inspect_table(report: Report, all_primitives: bool) -> str:
    """Totals in rows, then a line for each primitive, or for the largest."""
    primitives = report["primitives"]
    listing = primitives if all_primitives else _largest(primitives)
    lines = [
        f"{printable(report['file'])} ({size(report['file_bytes'])})",
        *(f"{label:{LABEL_WIDTH}}{value}" for label, value in _inspect_rows(report)),
        *map(_primitive_line, listing),
        *(line for lod in report["lod"][:MAX_PRIMITIVES] for line in _lod_lines(lod)),
    ]
    if len(listing) < len(primitives):
        lines.append(
            f"the {len(listing)} largest of {len(primitives):,} primitives; --all shows every one"
        )
    return "\n".join(lines)


def _inspect_rows(report: Report) -> list[tuple[str, str]]:
    totals = report["totals"]
    bits = totals["bits_per_triangle"]
    symbols = (f"{symbol} {100 * fraction:.1f} %" for symbol, fraction in totals["symbols"].items())
    fallback = report["fallback_files"].items()
    mean = f"{totals['mean_triangles_per_meshlet']:.2f} triangles on average"
    distinct = f"{totals['source_vertices']:,} distinct in the source"
    return [
        ("triangles", f"{totals['triangles']:,}"),
        ("vertices", f"{totals['vertices']:,} ({distinct})"),
        ("meshlets", f"{totals['meshlets']:,}, {mean}"),
        ("blobs", f"{totals['blobs']:,}"),
        ("raw", f"{totals['raw_bytes']:,} bytes"),
        ("compressed", f"{totals['compressed_bytes']:,} bytes"),
        ("ratio", f"{totals['ratio']:.2f}"),
        ("bits per triangle", f"{bits['total']:.3f}"),
        *((f"  {label}", f"{value:.3f}") for label, value in labelled_bits(bits)),
        ("symbols", ", ".join(symbols)),
        *(("fallback", f"{count:,} bytes in {printable(name)}") for name, count in fallback),
    ]


def _lod_lines(lod: Report) -> list[str]:
    """The levels of one primitive."""
    total = lod["page_bytes"] + lod["table_bytes"]
    finest = lod["levels"][0]
    per_triangle = total / finest["stored_triangles"]
    return [
        f"levels of mesh {lod['mesh']} primitive {lod['primitive']}: "
        f"{plural(lod['pages'], 'page')} of at most {lod['largest_page']:,} bytes, "
        f"{lod['root_pages']} always loaded; {lod['page_bytes']:,} bytes and "
        f"{lod['table_bytes']:,} of tables, {per_triangle:.2f} per triangle",
        *(
            f"  level {number}: {plural(level['triangles'], 'triangle')}, "
            f"{plural(level['clusters'], 'meshlet')} in {plural(level['groups'], 'group')}, "
            f"{level['bytes']:,} bytes, error {level['error']:.3g}"
            + (
                f", {plural(level['stuck_triangles'], 'triangle')} not simplified"
                if level["stuck_triangles"]
                else ""
            )
            for number, level in enumerate(lod["levels"])
        ),
    ]


def labelled_bits(bits_per_triangle: dict[str, float]) -> list[tuple[str, float]]:
    """(label, bits) of each category that takes any."""
    from gltf_ext.commands.inspect import CATEGORY_LABELS

    return [
        (label, bits_per_triangle[category])
        for category, label in CATEGORY_LABELS.items()
        if bits_per_triangle[category]
    ]


def _largest(primitives: list[Report]) -> list[Report]:
    """The primitives with most triangles, in the file's order."""
    by_size = sorted(
        range(len(primitives)), key=lambda index: -primitives[index].get("triangles", 0)
    )
    return [primitives[index] for index in sorted(by_size[:MAX_PRIMITIVES])]


def _primitive_line(primitive: Report) -> str:
    title = f"mesh {primitive['mesh']} primitive {primitive['primitive']}"
    if primitive["name"]:
        title += f" ({primitive['name']})"
    if "shares_buffer_view_of" in primitive:
        mesh, index = primitive["shares_buffer_view_of"]
        return f"{title}: the same data as mesh {mesh} primitive {index}"
    attributes = ", ".join(
        f"{name} {'+'.join(map(str, attribute['bits_per_component']))}"
        for name, attribute in primitive["attributes"].items()
    )
    pages = f"{plural(primitive['blobs'], 'page')}, " if primitive["blobs"] > 1 else ""
    return (
        f"{title}: {plural(primitive['triangles'], 'triangle')}, "
        f"{plural(primitive['meshlets'], 'meshlet')}, {pages}ratio {primitive['ratio']:.2f}, "
        f"{primitive['bits_per_triangle']['total']:.2f} bits per triangle; bits: {attributes}; "
        f"position step {primitive['attributes']['POSITION']['step'][0]:.3g}"
    )


# --- verify ---


def verify_text(report: Report) -> str:
    """The verdict, a line for each attribute, and the problems."""
    counts = (
        f"{_verdict(report)}: {plural(report['triangles'], 'triangle')}, "
        f"{report['missing_triangles']:,} missing, {report['extra_triangles']:,} extra"
    )
    if report["collapsed_triangles"]:
        percent = f"{report['collapsed_area_percent']:.3g} % of the area"
        counts += f", {report['collapsed_triangles']:,} collapsed by the grid ({percent})"
    attributes = [f"{name:{NAME_WIDTH}} {_error(report, name)}" for name in report["max_error"]]
    topology = [_topology_line(report["topology"])] if report["topology"] else []
    levels = map(_level_line, report["levels"])
    unmeasured = [
        f"mesh {primitive['mesh']} primitive {primitive['primitive']}: levels are not measured"
        for primitive in report["not_measured"]
    ]
    return "\n".join(
        [
            counts,
            *topology,
            *attributes,
            *levels,
            *unmeasured,
            *report["problems"],
            *report["losses"],
        ]
    )


def _topology_line(topology: Report) -> str:
    decoded = topology["compressed"]
    counts = (
        f"{decoded['vertices']:,} vertices, "
        f"{plural(decoded['boundary_edges'], 'boundary edge')}, "
        f"{plural(decoded['islands'], 'island')}"
    )
    return counts + (", as in the original" if decoded == topology["original"] else "")


def _level_line(level: Report) -> str:
    shading = "".join(
        f", {name} off by {difference['median']:.2g} (95 %: {difference['p95']:.2g}"
        f"{_seen_text(difference['seen'])})"
        for name, difference in level["shading"].items()
    )
    flips = level["flipped_corners"]
    shading += f", {plural(flips, 'flipped corner')}" if flips else ""
    return (
        f"mesh {level['mesh']} primitive {level['primitive']} level {level['level']}: "
        f"{plural(level['triangles'], 'triangle')}, error {level['stated_error']:.3g} stated, "
        f"{level['measured_error']:.3g} measured{shading}"
    )


def _seen_text(seen: Report) -> str:
    return f"; 99 %: {seen['p99']:.3g}, 99.9 %: {seen['p99.9']:.3g} {seen['unit']}"


def _verdict(report: Report) -> str:
    if not report["triangles_equal"]:
        return "NOT THE SAME"
    topology = report["topology"]
    if topology and topology["original"] != topology["compressed"]:
        by_grid = "" if report["is_torn"] else " by the grid"
        return f"the same triangles, CONNECTED DIFFERENTLY{by_grid}"
    if report["losses"] or not report["errors_within_bits"]:
        return "the same triangles, BEYOND WHAT IS PROMISED"
    return "the same triangles, within the bits" + (
        "" if report["ok"] else ", WITH OTHER DIFFERENCES"
    )


def _error(report: Report, name: str) -> str:
    """The largest error, that of most of the area, and the RMS, in units that mean something."""
    largest, rms = report["max_error"][name], report["rms_error"][name]
    area = report["area_error"][name]
    if largest is None:
        return "not compared"
    if name in report["max_error_degrees"]:
        text = f"largest error {report['max_error_degrees'][name]:.3g} degrees"
        text += "" if area is None else f", 99.9 % of the area {math.degrees(area):.3g}"
        return f"{text}, RMS {math.degrees(rms):.3g} degrees"
    if name in report["seen_error"]:
        seen = report["seen_error"][name]
        text = f"largest error {seen['max']:.3g} {seen['unit']} ({largest:.3g})"
        text += "" if seen["area"] is None else f", 99.9 % of the area {seen['area']:.3g}"
        return f"{text}, RMS {rms:.3g}"
    if not largest:
        return "exact"
    percent, area_percent = (report[f"{kind}_error_percent"][name] for kind in ("max", "area"))
    text = f"largest error {percent:.3g} % of the box's diagonal ({largest:.3g})"
    text += "" if area is None else f", 99.9 % of the area {area_percent:.3g} %"
    return f"{text}, RMS {rms:.3g}"


def verify_json(report: Report) -> Report:
    """The report without infinity, which JSON lacks: None instead."""
    bounds = report["error_over_bound"].items()
    return {
        **report,
        "error_over_bound": {name: None if value == math.inf else value for name, value in bounds},
    }
