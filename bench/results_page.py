"""Where do we stand? One page from all committed measurements.

Reads bench/results/*.json and measures nothing. Writes docs/results.md and docs/figure8.png.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from bench import blender, figures, lod
from bench.common import (
    DOCS,
    best_in_bold,
    markdown_table,
    origin_line,
    progress,
    pyplot,
    read_result,
    write_page,
)
from bench.mitsuba import INTEGRATORS
from bench.models import PAPER_MODELS

OURS, PAPER = "ours", "the paper's encoding"
CLAIMED_RATIO = (4.26, 4.35)  # section 7 of the paper, of its models
EVEN = 0.02  # a ratio this close to 1 counts as even
NAMES = (
    "size",
    "paper",
    "table1",
    "speed",
    "quality",
    "vulkan_decode",
    "vulkan_raster",
    "vulkan_raytracing",
    "mitsuba",
    "blender",
    "parameters",
    "choices",
    "lod",
)
Results = dict[str, dict]  # by name; without the questions that are not measured


# --- where we stand ---


@dataclass(frozen=True)
class Standing:
    """One comparison: our figure and another's for some models.

    what: the question, with its unit
    other: the name of the other
    pairs: (ours, theirs) per model
    larger_wins: False if the smaller figure wins
    form: the format of figures
    note: the models, in words
    headline: True for the first table of the page
    their_range: replaces their figures if those are a claim
    """

    what: str
    other: str
    pairs: list[tuple[float, float]]
    larger_wins: bool
    form: str
    note: str
    headline: bool = False
    their_range: str = ""

    @property
    def times(self) -> float:
        """How many times better ours is, the median over models; below 1 the other is better."""
        return statistics.median(self._ratios)

    @property
    def _ratios(self) -> list[float]:
        return [ours / theirs if self.larger_wins else theirs / ours for ours, theirs in self.pairs]

    @property
    def verdict(self) -> str:
        if abs(self.times - 1) < EVEN:
            return "even"
        if self.times > 1:
            return f"ours, {self.times:.2f} times"
        return (
            f"**{self.other}**, {statistics.median(1 / ratio for ratio in self._ratios):.2f} times"
        )

    def row(self) -> list[str]:
        return [
            self.what,
            self._range(0),
            self.other,
            self.their_range or self._range(1),
            self.verdict,
            self.note,
        ]

    def _range(self, side: int) -> str:
        values = [pair[side] for pair in self.pairs]
        middle, low, high = (
            f"{value:{self.form}}"
            for value in (statistics.median(values), min(values), max(values))
        )
        return middle if low == high else f"{middle} ({low} to {high})"


def standings(results: Results) -> list[Standing]:
    """All comparisons that the results allow."""
    makers: dict[str, Callable[[dict], Iterable[Standing]]] = {
        "size": _size_standings,
        "speed": _speed_standings,
        "vulkan_raster": _raster_standings,
        "vulkan_raytracing": _raytracing_standings,
        "mitsuba": _mitsuba_standings,
    }
    return [
        standing
        for name, make in makers.items()
        if name in results
        for standing in make(results[name])
    ]


def _size_standings(result: dict) -> Iterable[Standing]:
    rows = {row["model"]: row["codecs"] for row in result["models"]}
    models = [rows[model] for model in PAPER_MODELS if model in rows]
    note = _models(model for model in PAPER_MODELS if model in rows)
    low, high = CLAIMED_RATIO
    pairs = [(model[OURS]["ratio"], (low + high) / 2) for model in models]
    yield Standing(
        "times smaller, drawn as it is",
        "the paper, as claimed",
        pairs,
        True,
        ".2f",
        note,
        True,
        f"{low} to {high}",
    )
    resident = ("resident_ratio", "times smaller, on the GPU", (PAPER, "quantised glTF"))
    files = (
        "ratio",
        "times smaller, as a file",
        ("Draco, level 7", "Draco, level 10", "Corto", "meshopt-compressed glTF"),
    )
    for key, what, others in (resident, files):
        for other in others:
            pairs = [(model[OURS][key], model[other][key]) for model in models if other in model]
            if pairs:
                headline = other != "Draco, level 10"
                yield Standing(what, other, pairs, True, ".2f", note, headline)


def _models(names: Iterable[str]) -> str:
    """The number of the paper's models (or their stand-ins), and the names of the others."""
    counts = Counter(iter(names))  # iter: Counter would take the values of a dict as counts
    ours = [
        f"{count} {name}" if count > 1 else name
        for name, count in counts.items()
        if name not in PAPER_MODELS
    ]
    papers = len(counts) - len(ours)
    return ", ".join([f"{papers} of the paper's"] * (papers > 0) + ours)


def _speed_standings(result: dict) -> Iterable[Standing]:
    large = [row for row in result["models"] if row["triangles"] >= 50_000]
    for task, models, what in (
        (
            "decode",
            result["paper_models"] or large,
            "decoding on the CPU, one thread, million triangles per second",
        ),
        ("encode", large, "encoding, one thread, million triangles per second"),
    ):
        note = _models(row["model"] for row in models)
        for other in (codec for codec in models[0][task] if not codec.startswith(OURS)):
            if task == "encode" and "meshopt" in other:
                continue  # timed as a command with files: not the same question
            pairs = [
                tuple(
                    row["triangles"] / row[task][codec]["seconds"]["median"] / 1e6
                    for codec in (OURS, other)
                )
                for row in models
            ]
            result_type = "; theirs to integers" if "meshopt" in other else ""
            yield Standing(
                what, other, pairs, True, ".3g", note + result_type, other != "Draco, level 0"
            )


def _milliseconds(row: dict) -> float:
    return row["milliseconds"]["median"]


def _megabytes(row: dict) -> float:
    """Megabytes resident on the GPU; a result has their number or a number per part."""
    resident = row["resident_bytes"]
    return (sum(resident.values()) if isinstance(resident, dict) else resident) / 1e6


def _paired(
    ours: list[dict], theirs: list[dict], value: Callable[[dict], float]
) -> dict[str, tuple[float, float]]:
    """(ours, theirs) for each model that both have."""
    others = {row["model"]: value(row) for row in theirs}
    return {
        row["model"]: (value(row), others[row["model"]]) for row in ours if row["model"] in others
    }


def _of_path(rows: list[dict], path: str) -> list[dict]:
    return [row for row in rows if row["path"] == path]


def unculled(result: dict) -> list[dict]:
    """Rows of vulkan_raster.json with culling off, which are drawn unlit."""
    return [row for row in result["rows"] if not row["culling"]]


def _raster_standings(result: dict) -> Iterable[Standing]:
    rows = unculled(result)
    others = {
        "vertex": "uncompressed, indexed draw",
        "mesh-plain": "uncompressed, mesh shader",
        "geometry": "compressed, geometry shader",
    }
    for path in ("stream", "mesh", "mesh-only"):
        for other, name in others.items():
            pairs = _paired(_of_path(rows, path), _of_path(rows, other), _milliseconds)
            if pairs:
                note = f"{_models(pairs)}; {_pixels(result)}, unlit, no culling"
                headline = path == "stream" and other != "geometry"
                yield Standing(
                    f"frame on the GPU, path `{path}`, ms",
                    name,
                    [*pairs.values()],
                    False,
                    ".3g",
                    note,
                    headline,
                )
    for path in ("stream", "mesh-only"):
        pairs = _paired(_of_path(rows, path), _of_path(rows, "vertex"), _megabytes)
        if pairs:
            what = f"resident on the GPU, path `{path}`, MB"
            yield Standing(
                what, others["vertex"], [*pairs.values()], False, ".3g", _models(pairs), True
            )


def _pixels(result: dict) -> str:
    return f"{result['width']} x {result['height']}"


def _raytracing_standings(result: dict) -> Iterable[Standing]:
    rows = result["rows"]
    for cache in (1, 0.25):
        ours = [row for row in _of_path(rows, "rt") if _share(row.get("cache")) == cache]
        bounces = min((row.get("bounces") or 0 for row in ours), default=0)
        ours, theirs = (
            [row for row in chosen if (row.get("bounces") or 0) == bounces]
            for chosen in (ours, _of_path(rows, "rt-triangles"))
        )
        for what, value in (("ms", _milliseconds), ("MB", _megabytes)):
            pairs = _paired(ours, theirs, value)
            if pairs:
                what = f"ray tracing on the GPU, {cache:.0%} cached, {what}"
                name = "uncompressed, the driver's triangles"
                note = f"{_models(pairs)}; {_pixels(result)}, {bounces} bounces"
                yield Standing(what, name, [*pairs.values()], False, ".3g", note, cache == 1)


def _share(cache) -> float | None:
    """The cache's size as a share; older results give percent."""
    return cache / 100 if isinstance(cache, (int, float)) and cache > 1 else cache


def mitsuba_rows(result: dict, task: str) -> dict[tuple[str, str], dict[float | None, dict]]:
    """Rows of one task ("time", "memory"), by model and variant and then by the cache's share.

    Share None is Mitsuba's own mesh. Only rows of the default policy.
    """
    rows: dict[tuple[str, str], dict] = {}
    for run in result["runs"]:
        if run["task"] == task:
            of_run = rows.setdefault((run["model"], run["variant"]), {})
            for row in run["rows"]:
                of_run.setdefault(row["fraction"], row)
    return rows


def _times_native(row: dict, native: dict, integrator: str) -> float:
    """Time over that of Mitsuba's own mesh: the median ratio of the rounds if the result has it."""
    return row.get(f"{integrator}_ratio", row[integrator] / native[integrator])


def _mitsuba_standings(result: dict) -> Iterable[Standing]:
    times, memory = mitsuba_rows(result, "time"), mitsuba_rows(result, "memory")
    for variant in dict.fromkeys(variant for _, variant in times):
        for share in (1.0, 0.25):
            for integrator in INTEGRATORS:
                pairs = {
                    model: (
                        _times_native(rows[share], rows[None], integrator) * rows[None][integrator],
                        rows[None][integrator],
                    )
                    for (model, of), rows in times.items()
                    if of == variant and {share, None} <= rows.keys()
                }
                what = f"Mitsuba {variant}, {integrator}, {share:.0%} cached, s"
                if pairs:
                    headline = share == 0.25 and integrator == "path"
                    yield Standing(
                        what,
                        "Mitsuba's own mesh",
                        [*pairs.values()],
                        False,
                        ".3g",
                        _models(pairs),
                        headline,
                    )
        pairs = {
            model: (rows[0.25]["bytes"] / 1e6, rows[None]["bytes"] / 1e6)
            for (model, of), rows in memory.items()
            if of == variant and {0.25, None} <= rows.keys()
        }
        if pairs:
            what = f"Mitsuba {variant}, memory, 25% cached, MB"
            yield Standing(
                what, "Mitsuba's own mesh", [*pairs.values()], False, ".3g", _models(pairs), True
            )


STANDING_HEADINGS = ["", "ours", "beside", "theirs", "better", "measured on"]


def standing_table(found: Iterable[Standing]) -> str:
    return markdown_table(STANDING_HEADINGS, [standing.row() for standing in found])


# --- the paper's Figures 8 and 9 ---


def figure8(results: Results) -> dict[str, dict[str, float]]:
    """Milliseconds by model and method: means on the CPU, medians on the GPU; may be empty."""
    bars: dict[str, dict[str, float]] = {}
    for row in results.get("speed", {}).get("paper_models", []):
        decode = row["decode"]
        bars[row["model"]] = {"ours, CPU": 1000 * decode[OURS]["native_mean_seconds"]}
        for codec in ("Draco, level 7", "Corto"):
            if codec in decode:
                bars[row["model"]][f"{codec}, CPU"] = 1000 * decode[codec]["mean_seconds"]
    if "vulkan_raster" in results:
        rows = unculled(results["vulkan_raster"])
        names = {
            "stream": "ours, GPU, path stream",
            "mesh": "ours, GPU, path mesh, as in the paper",
            "vertex": "uncompressed, GPU",
        }
        for path, name in names.items():
            for row in _of_path(rows, path):
                if row["model"] in bars:
                    bars[row["model"]][name] = _milliseconds(row)
    return bars


def _figure8_table(bars: dict[str, dict[str, float]]) -> str:
    methods = list(dict.fromkeys(method for of_model in bars.values() for method in of_model))
    rows = [
        [model, *best_in_bold([of_model.get(method) for method in methods], ".3g", largest=False)]
        for model, of_model in bars.items()
    ]
    return markdown_table(["model, ms", *methods], rows)


# --- sections ---


@dataclass(frozen=True)
class Section:
    """One question on the page.

    name: of its result
    pages, pictures: file names in docs
    text: makes the text and table from the result
    """

    title: str
    name: str
    pages: tuple[str, ...]
    pictures: tuple[str, ...]
    text: Callable[[dict], str]


def _size_text(result: dict) -> str:
    rows = {row["model"]: row["codecs"] for row in result["models"]}
    names = list(dict.fromkeys(name for codecs in rows.values() for name in codecs))
    cells = [
        [model, *best_in_bold([codecs.get(name, {}).get("ratio") for name in names], ".2f")]
        for model, codecs in rows.items()
    ]
    return (
        "How many times smaller than raw, as files. The smallest file of each row is in bold.\n\n"
        + markdown_table(["model", *names], cells)
    )


def _paper_text(result: dict) -> str:
    claims = result["claims"]
    keys = (
        "connectivity",
        "extra_bits_per_meshlet",
        "index_bits_per_triangle",
        "vertex_ratio",
        "ratio",
    )
    rows = [["*claimed*", *(claims[key] for key in keys)]]
    for row in result["rows"]:
        if row["model"] in PAPER_MODELS:
            stated = {**row, "connectivity": row["bits_per_triangle"]["connectivity"]}
            rows.append(
                [f"{row['model']}, {row['meshlets_of']}", *(f"{stated[key]:.2f}" for key in keys)]
            )
    return (
        "The paper's encoding on our models, and the paper's claims for its own.\n\n"
        + markdown_table(
            [
                "model, meshlets as full as",
                "connectivity, bits per triangle",
                "tables, bits per meshlet",
                "both, bits per triangle",
                "vertices, times smaller",
                "all, times smaller",
            ],
            rows,
        )
    )


def _table1_text(result: dict) -> str:
    rows = [
        [f"the paper, weight `{weight}`", *map(str, bins)]
        for weight, bins in result["claimed"].items()
    ]
    for row in result["rows"]:
        fill = "default fill" if row["fill"] is None else f"fill {row['fill']}"
        rows.append([f"ours, weight `{row['weight']}`, {fill}", *map(str, row["histogram"])])
    return (
        "Regions of the Stanford Dragon by number of triangles, before halving.\n\n"
        + markdown_table(["", "[0, 32)", "[32, 64)", "[64, 72)", "72 and more"], rows)
    )


def _speed_text(result: dict) -> str:
    models = result["models"]
    codecs = list(models[0]["decode"])
    rows = [
        [
            f"{row['model']}, {row['triangles']:,}",
            *best_in_bold(
                [
                    row["triangles"] / row["decode"][codec]["seconds"]["median"] / 1e6
                    for codec in codecs
                ],
                ".1f",
            ),
            f"{row['triangles'] / row['encode'][OURS]['all_threads_seconds']['median'] / 1e6:.2f}",
            f"{row['command']['peak_bytes'] / 1e6:.0f}",
        ]
        for row in models
    ]
    series = [row for row in models if row["model"] == "torus"]
    first, last = series[0], series[-1]
    growth = (
        f"From {first['triangles']:,} to {last['triangles']:,} triangles, "
        f"{last['triangles'] / first['triangles']:.0f} times as many, encoding takes "
        f"{_growth(first, last, 'encode'):.0f} and decoding "
        f"{_growth(first, last, 'decode'):.0f} times as long.\n"
    )
    return (
        """Million triangles per second: decoding from Python on one thread to floats (meshopt: to
integers), the fastest of each row in bold; and encoding on all threads. Last column: peak memory
of the whole command.\n\n"""
        + markdown_table(
            [
                "model, triangles",
                *(f"decode, {codec}" for codec in codecs),
                "encode, ours",
                "compress, peak MB",
            ],
            rows,
        )
        + "\n"
        + growth
    )


def _growth(first: dict, last: dict, task: str) -> float:
    return last[task][OURS]["seconds"]["median"] / first[task][OURS]["seconds"]["median"]


def _quality_text(result: dict) -> str:
    rows = []
    for model in result["models"]:
        percent = 100 / model["longest_side"]
        for row in model["rows"]:
            errors, psnr = row["errors"], row["rendered"]["psnr"]
            rows.append(
                [
                    f"{model['model']}, {row['bits']}",
                    f"{percent * errors['POSITION']['max']:.4f}",
                    f"{percent * row['surface']['hausdorff']:.4f}",
                    *(
                        f"{errors[name]['max']:.3f}" if name in errors else ""
                        for name in ("NORMAL", "TEXCOORD_0")
                    ),
                    f"{psnr:.1f}" if psnr else "equal",
                    f"{row['ratio']:.2f}",
                ]
            )
    headings = [
        "model, bits",
        "positions, % of the longest side",
        "Hausdorff distance, %",
        "normals, degrees",
        "uv, texels of 4096",
        "picture, PSNR in dB",
        "ratio",
    ]
    return (
        "Largest errors for each number of bits. Picture and ratio are for positions of that many "
        "bits, the rest at the defaults.\n\n" + markdown_table(headings, rows)
    )


def _gpu_text(result: dict) -> str:
    """Milliseconds and memory by path and model."""
    cells = {
        (_variant(row), row["model"]): f"{_milliseconds(row):.3g}, {_megabytes(row):.1f} MB"
        for row in result["rows"]
    }
    models = dict.fromkeys(row["model"] for row in result["rows"])
    variants = dict.fromkeys(variant for variant, _ in cells)
    return (
        f"Milliseconds per frame of {_pixels(result)} pixels (medians), and memory on the GPU.\n\n"
        + markdown_table(
            ["path", *models],
            [
                [variant, *(cells.get((variant, model), "") for model in models)]
                for variant in variants
            ],
        )
    )


def _raster_text(result: dict) -> str:
    return (
        "`gltf-meshlet render` draws lit and with culling; unlit is the cheapest shader that reads "
        f"all attributes.\n{_gpu_text(result)}"
    )


def _gpu_decode_text(result: dict) -> str:
    """Triangles per second by method and model."""
    cells = {
        (row["method"], row["model"]): f"{row['triangles_per_second'] / 1e9:.2f}"
        for row in result["rows"]
    }
    models = {row["model"]: row["triangles"] for row in result["rows"]}
    methods = dict.fromkeys(method for method, _ in cells)
    return (
        "Billion triangles per second in compute shaders, all attributes to integers in plain "
        "buffers. Of a model with several parts, the largest.\n\n"
        + markdown_table(
            ["method", *(f"{model} ({count:,})" for model, count in models.items())],
            [[method, *(cells.get((method, model), "") for model in models)] for method in methods],
        )
    )


def _variant(row: dict) -> str:
    """A row's path and settings, in words."""
    parts = [row["path"]]
    if "culling" in row:
        parts.append("lit, culling" if row["culling"] else "unlit, no culling")
    if row.get("cache") is not None:
        parts.append(f"cache {_share(row['cache']):.0%}")
    if row.get("group") is not None:
        parts.append(f"boxes of {row['group']}")
    if row.get("bounces"):
        parts.append(f"{row['bounces']} bounces")
    return ", ".join(parts)


def _mitsuba_text(result: dict) -> str:
    rows = []
    memory = mitsuba_rows(result, "memory")
    for key, by_share in mitsuba_rows(result, "time").items():
        native, native_memory = by_share[None], memory[key][None]["bytes"]
        for share in sorted((share for share in by_share if share is not None), reverse=True):
            rows.append(
                [
                    f"{', '.join(key)}, {share:.0%}",
                    *(
                        f"{_times_native(by_share[share], native, name):.2f}"
                        for name in INTEGRATORS
                    ),
                    f"{memory[key][share]['bytes'] / native_memory:.2f}",
                ]
            )
    return (
        "Time and memory relative to Mitsuba's own mesh, by share of the geometry that is cached; "
        f"{result['width']} x {result['height']} pixels, {result['spp']} samples each.\n\n"
        + markdown_table(["model, variant, cache", *INTEGRATORS, "memory"], rows)
    )


def _parameters_text(result: dict) -> str:
    rows = [row for row in result["rows"] if row["option"] == "max_triangles"]
    cells = {}
    for row in rows:
        speed = row["triangles"] / row["decode_seconds"]["median"] / 1e6
        cells[row["model"], row["value"]] = f"{row['ratio']:.2f}, {speed:.1f}"
    models, values = (
        dict.fromkeys(row["model"] for row in rows),
        dict.fromkeys(row["value"] for row in rows),
    )
    return (
        "Ratio, and million triangles decoded per second on one thread, by the maximum number of "
        "triangles per meshlet.\n\n"
        + markdown_table(
            ["model", *map(str, values)],
            [[model, *(cells[model, value] for value in values)] for model in models],
        )
    )


def _blender_text(result: dict) -> str:
    return f"""File size, time and peak memory of imports into Blender, with all formats at the same
bits.

{blender.summary(result)}"""


def _lod_text(result: dict) -> str:
    return f"""All bytes of pages and tables at the default bits, and the cut whose error is one
pixel where the longest side of the largest primitive has {lod.PIXELS} pixels.

{lod.table(result)}"""


def _choices_text(result: dict) -> str:
    cases = list(result["switched"][0]["bits"])
    sharing = [
        (row["model"], row["bits_per_triangle"]["total"], row["boundary_bits_per_triangle"])
        for row in result["models"]
    ]
    return f"""Bits per triangle of whole files: as they are, and with single choices of the format
switched off.

{
        markdown_table(
            ["model", *cases],
            [
                [row["model"], *(f"{row['bits'][case]:.2f}" for case in cases)]
                for row in result["switched"]
            ],
        )
    }
An estimate for meshlets that store all of their boundary vertices, from the bits that these take
now.

{
        markdown_table(
            ["model", "as is", "boundaries stored by every meshlet"],
            [
                [model, f"{total:.2f}", f"{total + bits['alone'] - bits['shared']:.2f}"]
                for model, total, bits in sharing
            ],
        )
    }"""


SECTIONS = (
    Section("Size", "size", ("size.md",), ("figure7.png",), _size_text),
    Section("The paper's encoding", "paper", ("paper.md",), ("figure3.png",), _paper_text),
    Section("The paper's Table 1", "table1", ("table1.md",), (), _table1_text),
    Section("Speed on the CPU", "speed", ("speed.md",), ("speed.png",), _speed_text),
    Section(
        "Quality", "quality", ("quality.md",), ("quality_models.png", "quality.png"), _quality_text
    ),
    Section("Decoding on the GPU", "vulkan_decode", ("vulkan.md",), (), _gpu_decode_text),
    Section(
        "Drawing on the GPU", "vulkan_raster", ("vulkan.md",), ("vulkan-raster.png",), _raster_text
    ),
    Section(
        "Ray tracing on the GPU",
        "vulkan_raytracing",
        ("vulkan-raytracing.md",),
        ("vulkan-raytracing.png",),
        _gpu_text,
    ),
    Section(
        "Ray tracing with Mitsuba", "mitsuba", ("mitsuba.md",), ("mitsuba.png",), _mitsuba_text
    ),
    Section("Importing into Blender", "blender", ("blender.md",), (), _blender_text),
    Section("Parameters", "parameters", ("parameters.md",), ("parameters.png",), _parameters_text),
    Section(
        "Levels of detail", "lod", ("lod.md", "lod_results.md"), ("lod_pixels.png",), _lod_text
    ),
    Section("What each choice is worth", "choices", ("choices.md",), (), _choices_text),
)


def _section(section: Section, results: Results) -> str:
    heading = f"## {section.title}\n\n"
    if section.name not in results:
        return f"{heading}Not measured yet: run `python -m bench {section.name}`.\n"
    result = results[section.name]
    pictures = "".join(
        f"\n![{section.title}]({name})\n" for name in section.pictures if (DOCS / name).exists()
    )
    pages = [f"[{name}]({name})" for name in section.pages if (DOCS / name).exists()]
    more = f" All of it: {', '.join(pages)}." if pages else ""
    return f"{heading}{section.text(result)}{pictures}\n{measured_line(result)}{more}\n"


def measured_line(result: dict) -> str:
    """One sentence: command, date, machine and versions, as far as the result has them."""
    result = {**result, "script": result["script"].removeprefix("python -m ")}
    machine = result.get("machine", {})
    if (
        isinstance(machine, dict)
        and {"cpu", "cores"} <= machine.keys()
        and {"date", "commit"} <= result.keys()
    ):
        further = {
            key: value for key, value in machine.items() if key not in ("cpu", "cores", "system")
        }
        line = origin_line(result).strip() + (f" {_flat(further)}." if further else "")
    else:
        line = (
            f"Measured by `python -m {result['script']}`"
            + (f", {_flat(machine)}" if machine else "")
            + "."
        )
    if "device" in result:
        line += " On {name}, driver {driver}.".format(**result["device"])
    versions = [f"{name} {version}" for name, version in (result.get("versions") or {}).items()]
    versions += [
        f"{name} ({version})"
        for name, version in {**result.get("codecs", {}), **result.get("peers", {})}.items()
    ]
    return f"{line} With {', '.join(versions)}." if versions else line


def _flat(value) -> str:
    return (
        ", ".join(f"{key} {_flat(part)}" for key, part in value.items())
        if isinstance(value, dict)
        else str(value)
    )


# --- the page ---


def report(results: Results) -> str:
    """docs/results.md."""
    sections = "\n".join(_section(section, results) for section in SECTIONS)
    headlines, others = (
        standing_table(s for s in standings(results) if s.headline == shown)
        for shown in (True, False)
    )
    bars = figure8(results)
    figure = (
        f"""## The paper's Figures 8 and 9

Milliseconds to decode a model, without loading: on the CPU to arrays, on the GPU while drawing a
frame, unlit and without culling. The paper decodes in the shaders that draw, as path `mesh` does.
The default path, `stream`, decodes in compute shaders.

{_figure8_table(bars)}
![Milliseconds to decode](figure8.png)

"""
        if bars
        else ""
    )
    return f"""# Results

Written by `python -m bench results_page` from the measurements in bench/results. Only the claims of
[the paper](../README.md#the-paper) are copied by hand. `python -m bench` lists the measurements,
and `python -m bench NAME` repeats one on your machine.

## Where we stand

Each row gives medians over the models, with minimum and maximum, and who is better by how much: the
median of the ratios per model. If a peer is better, its name is in bold. Draco and Corto files must
be unpacked before drawing: on the GPU they are as large as the uncompressed model. Models "of the
paper's" are those of the paper or their stand-ins, see [the models](#the-models).

{headlines}
### Further comparisons

{others}
{figure}{sections}
## The models

{"".join(f"* {name}: {what}{chr(10)}" for name, what in PAPER_MODELS.items())}* torus, \
generated_*: see bench/generated.py
* beast: a character; chinesedragon, igea: scans of sculptures; engine: a CAD model of many parts \
with hard edges
* DamagedHelmet: a sample of glTF with textures
* dragon_x4: dragon with each triangle split into four and new normals; made by `--subdivide` of the
  GPU measurements

The models are not part of this repository, because several have no licence to redistribute them.
`GLTF_MESHLET_MODELS` names the folder that holds them. They were made from files of public
repositories: suzanne, igea and beast from
alecjacobson/common-3d-test-models, bunny from google/draco, dragon from horinoh/VKDX, \
materialball and sponza_like from
gkjohnson/3d-demo-data, bistro_like from there and from SaschaWillems/Vulkan-Assets, chinesedragon \
from the latter, engine from
assimp/assimp, DamagedHelmet from donmccurdy/glTF-Transform. suzanne was subdivided, bunny
simplified, dragon smoothed within the steps of its coarse positions; these three and the composites
are not published.
"""


# --- pictures ---


def save_figure8(bars: dict[str, dict[str, float]], path: Path) -> None:
    """Bars on a logarithmic scale, a group per model."""
    methods = list(dict.fromkeys(method for of_model in bars.values() for method in of_model))
    figure, axis = pyplot().subplots(figsize=(10, 4.2), dpi=100)
    width = 0.8 / len(methods)
    for k, method in enumerate(methods):
        places = [place for place, of_model in enumerate(bars.values()) if method in of_model]
        values = [of_model[method] for of_model in bars.values() if method in of_model]
        axis.bar(
            [place + (k - (len(methods) - 1) / 2) * width for place in places],
            values,
            width * 0.92,
            label=method,
        )
    axis.set_xticks(range(len(bars)), list(bars))
    axis.set_yscale("log")
    axis.set_ylabel("milliseconds")
    axis.grid(axis="y", alpha=0.3)
    axis.legend(frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=9)
    axis.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(path, metadata={figures.DIGEST: figures.digest(bars)})


def read_all() -> Results:
    return {name: result for name in NAMES if (result := read_result(name)) is not None}


def main() -> None:
    results = read_all()
    bars = figure8(results)
    if bars:
        save_figure8(bars, DOCS / "figure8.png")
    write_page("results", report(results))
    print(standing_table(standings(results)))
    progress("wrote docs/results.md")


if __name__ == "__main__":
    main()
