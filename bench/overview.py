"""Where do we stand? One document from all committed measurements.

Reads bench/results/*.json and measures nothing. Writes docs/results.md and docs/figure8.png.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from bench import blender, lod
from bench.common import (
    DOCS,
    best_in_bold,
    grouped_bars,
    markdown_table,
    origin_line,
    read_result,
    save_figure,
    table,
    versions,
    write_document,
)
from bench.mitsuba import INTEGRATORS
from bench.models import PAPER_MODELS

OURS, PAPER = "ours", "the paper's encoding"
CLAIMED_RATIO = (4.26, 4.35)  # section 7 of the paper, of its models
EVEN = 0.02  # a ratio this close to 1 counts as even
NATIVE_MESH = "Mitsuba's own mesh"
Results = dict[str, dict]  # by name; without the questions that are not measured
Pairs = list[tuple[str, tuple[float, float]]]  # of each model, our figure and the other's


# --- where we stand ---


@dataclass(frozen=True)
class Standing:
    """One comparison: our figure and another's for some models.

    what: the question, with its unit
    other: the name of the other
    pairs: (ours, theirs) per model
    note: the models, in words
    larger_wins: False if the smaller figure wins
    form: the format of figures
    headline: True for the first table of the document
    their_range: replaces their figures if those are a claim
    """

    what: str
    other: str
    pairs: list[tuple[float, float]]
    note: str
    headline: bool = False
    larger_wins: bool = False
    form: str = ".3g"
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
        times = statistics.median(1 / ratio for ratio in self._ratios)
        return f"**{self.other}**, {times:.2f} times"

    def figures(self, side: int) -> str:
        """Median, minimum and maximum of ours (0) or theirs (1)."""
        values = [pair[side] for pair in self.pairs]
        numbers = (statistics.median(values), min(values), max(values))
        middle, low, high = (f"{number:{self.form}}" for number in numbers)
        return middle if low == high else f"{middle} ({low} to {high})"


def standing_table(found: Iterable[Standing]) -> str:
    return table(
        found,
        {
            "": lambda standing: standing.what,
            "ours": lambda standing: standing.figures(0),
            "beside": lambda standing: standing.other,
            "theirs": lambda standing: standing.their_range or standing.figures(1),
            "better": lambda standing: standing.verdict,
            "measured on": lambda standing: standing.note,
        },
    )


def standings(results: Results) -> list[Standing]:
    """All comparisons that the results allow."""
    makers: dict[str, Callable[[dict], Iterator[Standing]]] = {
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
        if standing.pairs
    ]


def _standing(what: str, other: str, pairs: Pairs, note: str = "", **more) -> Standing:
    """The note begins with the models of the pairs."""
    models = _models(model for model, _ in pairs)
    return Standing(what, other, [pair for _, pair in pairs], models + note, **more)


def _models(names: Iterable[str]) -> str:
    """The number of the paper's models (or their stand-ins), and the names of the others."""
    counts = Counter(names)
    ours = [
        f"{count} {name}" if count > 1 else name
        for name, count in counts.items()
        if name not in PAPER_MODELS
    ]
    papers = len(counts) - len(ours)
    return ", ".join([f"{papers} of the paper's"] * (papers > 0) + ours)


def _size_standings(result: dict) -> Iterator[Standing]:
    rows = {row["model"]: row["codecs"] for row in result["models"]}
    models = [(model, rows[model]) for model in PAPER_MODELS if model in rows]
    ratios: dict = {"larger_wins": True, "form": ".2f"}
    low, high = CLAIMED_RATIO
    yield _standing(
        "times smaller, drawn as it is",
        "the paper, as claimed",
        [(model, (codecs[OURS]["ratio"], (low + high) / 2)) for model, codecs in models],
        headline=True,
        their_range=f"{low} to {high}",
        **ratios,
    )
    files = ("Draco, level 7", "Draco, level 10", "Corto", "meshopt-compressed glTF")
    for key, what, others in (
        ("resident_ratio", "times smaller, on the GPU", (PAPER, "quantised glTF")),
        ("ratio", "times smaller, as a file", files),
    ):
        for other in others:
            pairs = [
                (model, (codecs[OURS][key], codecs[other][key]))
                for model, codecs in models
                if other in codecs
            ]
            yield _standing(what, other, pairs, headline=other != "Draco, level 10", **ratios)


def _speed_standings(result: dict) -> Iterator[Standing]:
    large = [row for row in result["models"] if row["triangles"] >= 50_000]
    for task, models, what in (
        ("decode", result["paper_models"] or large, "decoding on the CPU"),
        ("encode", large, "encoding"),
    ):
        for other in (codec for codec in models[0][task] if not codec.startswith(OURS)):
            if task == "encode" and "meshopt" in other:
                continue  # timed as a command with files: not the same question
            pairs = [
                (row["model"], (_rate(row, task, OURS), _rate(row, task, other))) for row in models
            ]
            yield _standing(
                f"{what}, one thread, million triangles per second",
                other,
                pairs,
                "; theirs to integers" if "meshopt" in other else "",
                headline=other != "Draco, level 0",
                larger_wins=True,
            )


def _rate(row: dict, task: str, codec: str) -> float:
    """Million triangles per second on one thread."""
    return row["triangles"] / row[task][codec]["seconds"]["median"] / 1e6


def _milliseconds(row: dict) -> float:
    return row["milliseconds"]["median"]


def _megabytes(row: dict) -> float:
    """Megabytes resident on the GPU; a result has their number or a number per use."""
    resident = row["resident_bytes"]
    return (sum(resident.values()) if isinstance(resident, dict) else resident) / 1e6


def _paired(ours: list[dict], theirs: list[dict], value: Callable[[dict], float]) -> Pairs:
    """The pairs of the models that both have."""
    others = {row["model"]: value(row) for row in theirs}
    return [
        (row["model"], (value(row), others[row["model"]])) for row in ours if row["model"] in others
    ]


def _of_path(rows: list[dict], path: str) -> list[dict]:
    return [row for row in rows if row["path"] == path]


def unculled(result: dict) -> list[dict]:
    """Rows of vulkan_raster.json with culling off, which are drawn unlit."""
    return [row for row in result["rows"] if not row["culling"]]


def _raster_standings(result: dict) -> Iterator[Standing]:
    rows = unculled(result)
    others = {
        "vertex": "uncompressed, indexed draw",
        "mesh-plain": "uncompressed, mesh shader",
        "geometry": "compressed, geometry shader",
    }
    for path in ("stream", "mesh"):
        for other, name in others.items():
            yield _standing(
                f"frame on the GPU, path `{path}`, ms",
                name,
                _paired(_of_path(rows, path), _of_path(rows, other), _milliseconds),
                f"; {_pixels(result)}, unlit, no culling",
                headline=path == "stream" and other != "geometry",
            )
    for path in ("stream", "mesh"):
        yield _standing(
            f"resident on the GPU, path `{path}`, MB",
            others["vertex"],
            _paired(_of_path(rows, path), _of_path(rows, "vertex"), _megabytes),
            headline=True,
        )


def _pixels(result: dict) -> str:
    return f"{result['width']} x {result['height']}"


def _raytracing_standings(result: dict) -> Iterator[Standing]:
    rows = result["rows"]
    for cache in (1, 0.25):
        ours = [row for row in _of_path(rows, "rt") if row["cache"] == cache]
        bounces = min((row["bounces"] for row in ours), default=0)
        ours, theirs = (
            [row for row in chosen if row["bounces"] == bounces]
            for chosen in (ours, _of_path(rows, "rt-triangles"))
        )
        for unit, value in (("ms", _milliseconds), ("MB", _megabytes)):
            yield _standing(
                f"ray tracing on the GPU, {cache:.0%} cached, {unit}",
                "uncompressed, the driver's triangles",
                _paired(ours, theirs, value),
                f"; {_pixels(result)}, {bounces} bounces",
                headline=cache == 1,
            )


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


def _mitsuba_standings(result: dict) -> Iterator[Standing]:
    times, memory = mitsuba_rows(result, "time"), mitsuba_rows(result, "memory")

    def paired(of_task: dict, variant: str, share: float, figures: Callable) -> Pairs:
        return [
            (model, figures(rows[share], rows[None]))
            for (model, of), rows in of_task.items()
            if of == variant and {share, None} <= rows.keys()
        ]

    for variant in dict.fromkeys(variant for _, variant in times):
        for share in (1.0, 0.25):
            for name in INTEGRATORS:

                def seconds(row: dict, native: dict, name=name) -> tuple[float, float]:
                    return _times_native(row, native, name) * native[name], native[name]

                yield _standing(
                    f"Mitsuba {variant}, {name}, {share:.0%} cached, s",
                    NATIVE_MESH,
                    paired(times, variant, share, seconds),
                    headline=share == 0.25 and name == "path",
                )
        yield _standing(
            f"Mitsuba {variant}, memory, 25% cached, MB",
            NATIVE_MESH,
            paired(memory, variant, 0.25, lambda r, n: (r["bytes"] / 1e6, n["bytes"] / 1e6)),
            headline=True,
        )


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
        names = {
            "stream": "ours, GPU, path stream",
            "mesh": "ours, GPU, path mesh, as in the paper",
            "vertex": "uncompressed, GPU",
        }
        for path, name in names.items():
            for row in _of_path(unculled(results["vulkan_raster"]), path):
                if row["model"] in bars:
                    bars[row["model"]][name] = _milliseconds(row)
    return bars


def _figure8_section(bars: dict[str, dict[str, float]]) -> str:
    """Empty if nothing is measured."""
    methods = dict.fromkeys(method for of_model in bars.values() for method in of_model)
    rows = [
        [model, *best_in_bold(map(of_model.get, methods), ".3g", largest=False)]
        for model, of_model in bars.items()
    ]
    if not bars:
        return ""
    return f"""## The paper's Figures 8 and 9

Milliseconds to decode a model, without loading: on the CPU to arrays, on the GPU while drawing a
frame, unlit and without culling. The paper decodes in the shaders that draw, as path `mesh` does.
The default path, `stream`, decodes in compute shaders.

{markdown_table(["model, ms", *methods], rows)}
![Milliseconds to decode](figure8.png)

"""


# --- sections ---


@dataclass(frozen=True)
class Section:
    """One question of the document.

    name: of its result
    text: makes the text and table from the result
    documents, pictures: names of files in docs
    """

    title: str
    name: str
    text: Callable[[dict], str]
    documents: tuple[str, ...]
    pictures: tuple[str, ...] = ()


def _size_text(result: dict) -> str:
    names = dict.fromkeys(name for row in result["models"] for name in row["codecs"])
    cells = [
        [
            row["model"],
            *best_in_bold((row["codecs"].get(name, {}).get("ratio") for name in names), ".2f"),
        ]
        for row in result["models"]
    ]
    return f"""How many times smaller than raw, as files. The smallest file of each row is in bold.

{markdown_table(["model", *names], cells)}"""


def _paper_text(result: dict) -> str:
    keys = {
        "connectivity, bits per triangle": "connectivity",
        "tables, bits per meshlet": "extra_bits_per_meshlet",
        "both, bits per triangle": "index_bits_per_triangle",
        "vertices, times smaller": "vertex_ratio",
        "all, times smaller": "ratio",
    }
    rows = [["*claimed*", *(result["claims"][key] for key in keys.values())]]
    for row in result["rows"]:
        if row["model"] in PAPER_MODELS:
            stated = {**row, "connectivity": row["bits_per_triangle"]["connectivity"]}
            figures = (f"{stated[key]:.2f}" for key in keys.values())
            rows.append([f"{row['model']}, {row['meshlets_of']}", *figures])
    return f"""The paper's encoding on our models, and the paper's claims for its own.

{markdown_table(["model, meshlets as full as", *keys], rows)}"""


def _table1_text(result: dict) -> str:
    rows = [
        [f"the paper, weight `{weight}`", *map(str, bins)]
        for weight, bins in result["claimed"].items()
    ]
    for row in result["rows"]:
        fill = "default fill" if row["fill"] is None else f"fill {row['fill']}"
        rows.append([f"ours, weight `{row['weight']}`, {fill}", *map(str, row["histogram"])])
    return f"""Regions of the Stanford Dragon by number of triangles, before halving.

{markdown_table(["", "[0, 32)", "[32, 64)", "[64, 72)", "72 and more"], rows)}"""


def _speed_text(result: dict) -> str:
    models = result["models"]
    codecs = list(models[0]["decode"])
    rows = [
        [
            f"{row['model']}, {row['triangles']:,}",
            *best_in_bold((_rate(row, "decode", codec) for codec in codecs), ".1f"),
            f"{row['triangles'] / row['encode'][OURS]['all_threads_seconds']['median'] / 1e6:.2f}",
            f"{row['command']['peak_bytes'] / 1e6:.0f}",
        ]
        for row in models
    ]
    headings = [*(f"decode, {codec}" for codec in codecs), "encode, ours", "compress, peak MB"]
    series = [row for row in models if row["model"] == "torus"]
    first, last = series[0], series[-1]
    encode, decode = (
        last[task][OURS]["seconds"]["median"] / first[task][OURS]["seconds"]["median"]
        for task in ("encode", "decode")
    )
    return f"""Million triangles per second: decoding from Python on one thread to floats
(meshopt: to integers), the fastest of each row in bold; and encoding on all threads. Last column:
peak memory of the whole command.

{markdown_table(["model, triangles", *headings], rows)}
From {first["triangles"]:,} to {last["triangles"]:,} triangles, \
{last["triangles"] / first["triangles"]:.0f} times as many, encoding takes \
{encode:.0f} and decoding {decode:.0f} times as long.
"""


def _quality_text(result: dict) -> str:
    rows = [(model, row) for model in result["models"] for row in model["rows"]]

    def percent(model: dict, length: float) -> str:
        return f"{100 / model['longest_side'] * length:.4f}"

    def largest(row: dict, name: str) -> str:
        return f"{row['errors'][name]['max']:.3f}" if name in row["errors"] else ""

    def psnr(row: dict) -> str:
        return f"{row['rendered']['psnr']:.1f}" if row["rendered"]["psnr"] else "equal"

    columns: dict[str, Callable[[tuple[dict, dict]], str]] = {
        "model, bits": lambda of: f"{of[0]['model']}, {of[1]['bits']}",
        "positions, % of the longest side": lambda of: percent(
            of[0], of[1]["errors"]["POSITION"]["max"]
        ),
        "Hausdorff distance, %": lambda of: percent(of[0], of[1]["surface"]["hausdorff"]),
        "normals, degrees": lambda of: largest(of[1], "NORMAL"),
        "uv, texels of 4096": lambda of: largest(of[1], "TEXCOORD_0"),
        "picture, PSNR in dB": lambda of: psnr(of[1]),
        "ratio": lambda of: f"{of[1]['ratio']:.2f}",
    }
    return (
        "Largest errors for each number of bits. Picture and ratio are for positions of that many "
        f"bits, the rest at the defaults.\n\n{table(rows, columns)}"
    )


def _by_model(first: str, rows: list[dict], line: Callable[[dict], str], cell, heading) -> str:
    """A table with a column for each model; `line` names the line of a row."""
    cells = {(line(row), row["model"]): cell(row) for row in rows}
    models = {row["model"]: heading(row) for row in rows}
    return markdown_table(
        [first, *models.values()],
        [
            [name, *(cells.get((name, model), "") for model in models)]
            for name in dict.fromkeys(name for name, _ in cells)
        ],
    )


def _gpu_text(result: dict) -> str:
    """Milliseconds and memory by path and model."""
    cells = _by_model(
        "path",
        result["rows"],
        _variant,
        lambda row: f"{_milliseconds(row):.3g}, {_megabytes(row):.1f} MB",
        lambda row: row["model"],
    )
    return f"""Milliseconds per frame of {_pixels(result)} pixels (medians), and memory on the GPU.

{cells}"""


def _raster_text(result: dict) -> str:
    return (
        "`gltf-meshlet render` draws lit and with culling; unlit is the cheapest shader that reads "
        f"all attributes.\n{_gpu_text(result)}"
    )


def _gpu_decode_text(result: dict) -> str:
    """Triangles per second by method and model."""
    cells = _by_model(
        "method",
        result["rows"],
        lambda row: row["method"],
        lambda row: f"{row['triangles_per_second'] / 1e9:.2f}",
        lambda row: f"{row['model']} ({row['triangles']:,})",
    )
    return f"""Billion triangles per second in compute shaders, all attributes to integers in plain
buffers. Of a model with several primitives, the largest.

{cells}"""


def _variant(row: dict) -> str:
    """A row's path and settings, in words."""
    words = [row["path"]]
    if "culling" in row:
        words.append("lit, culling" if row["culling"] else "unlit, no culling")
    if row.get("cache") is not None:
        words.append(f"cache {row['cache']:.0%}")
    if row.get("group") is not None:
        words.append(f"boxes of {row['group']}")
    if row.get("bounces"):
        words.append(f"{row['bounces']} bounces")
    return ", ".join(words)


def _mitsuba_text(result: dict) -> str:
    rows = []
    memory = mitsuba_rows(result, "memory")
    for key, by_share in mitsuba_rows(result, "time").items():
        native, grown = by_share.pop(None), memory[key]
        for share, row in sorted(by_share.items(), reverse=True):
            times = (f"{_times_native(row, native, name):.2f}" for name in INTEGRATORS)
            memory_ratio = f"{grown[share]['bytes'] / grown[None]['bytes']:.2f}"
            rows.append([f"{', '.join(key)}, {share:.0%}", *times, memory_ratio])
    return (
        "Time and memory relative to Mitsuba's own mesh, by share of the geometry that is cached; "
        f"{_pixels(result)} pixels, {result['spp']} samples each.\n\n"
        + markdown_table(["model, variant, cache", *INTEGRATORS, "memory"], rows)
    )


def _parameters_text(result: dict) -> str:
    def cell(row: dict) -> str:
        speed = row["triangles"] / row["decode_seconds"]["median"] / 1e6
        return f"{row['ratio']:.2f}, {speed:.1f}"

    rows = [row for row in result["rows"] if row["option"] == "max_triangles"]
    models = dict.fromkeys(row["model"] for row in rows)
    lines = [[model, *(cell(row) for row in rows if row["model"] == model)] for model in models]
    values = dict.fromkeys(str(row["value"]) for row in rows)
    return (
        "Ratio, and million triangles decoded per second on one thread, by the maximum number of "
        f"triangles per meshlet.\n\n{markdown_table(['model', *values], lines)}"
    )


def _blender_text(result: dict) -> str:
    return f"""File size, time and peak memory of imports into Blender, with all formats at the same
bits.

{blender.summary(result)}"""


def _lod_text(result: dict) -> str:
    return f"""All bytes of pages and tables at the default bits.

{lod.size_table(result)}
Triangles and bytes of cuts, times those of a discrete chain of whole models at the same measured
error: geometric means over {len(lod.THRESHOLDS)} errors.

{lod.sweep_table(result)}"""


def _choices_text(result: dict) -> str:
    cases = list(result["switched"][0]["bits"])
    switched = [
        [row["model"], *(f"{row['bits'][case]:.2f}" for case in cases)]
        for row in result["switched"]
    ]

    def unshared(row: dict) -> str:
        bits = row["boundary_bits_per_triangle"]
        return f"{row['bits_per_triangle']['total'] + bits['alone'] - bits['shared']:.2f}"

    sharing = table(
        result["models"],
        {
            "model": lambda row: row["model"],
            "as is": lambda row: f"{row['bits_per_triangle']['total']:.2f}",
            "boundaries stored by every meshlet": unshared,
        },
    )
    return f"""Bits per triangle of whole files: as they are, and with single choices of the format
switched off.

{markdown_table(["model", *cases], switched)}
An estimate for meshlets that store all of their boundary vertices, from the bits that these take
now.

{sharing}"""


SECTIONS = (
    Section("Size", "size", _size_text, ("size.md",), ("figure7.png",)),
    Section("The paper's encoding", "paper", _paper_text, ("paper.md",), ("figure3.png",)),
    Section("The paper's Table 1", "table1", _table1_text, ("table1.md",)),
    Section("Speed on the CPU", "speed", _speed_text, ("speed.md",), ("speed.png",)),
    Section(
        "Quality", "quality", _quality_text, ("quality.md",), ("quality_models.png", "quality.png")
    ),
    Section("Decoding on the GPU", "vulkan_decode", _gpu_decode_text, ("vulkan.md",)),
    Section(
        "Drawing on the GPU", "vulkan_raster", _raster_text, ("vulkan.md",), ("vulkan-raster.png",)
    ),
    Section(
        "Ray tracing on the GPU",
        "vulkan_raytracing",
        _gpu_text,
        ("vulkan-raytracing.md",),
        ("vulkan-raytracing.png",),
    ),
    Section(
        "Ray tracing with Mitsuba", "mitsuba", _mitsuba_text, ("mitsuba.md",), ("mitsuba.png",)
    ),
    Section("Importing into Blender", "blender", _blender_text, ("blender.md",)),
    Section("Parameters", "parameters", _parameters_text, ("parameters.md",), ("parameters.png",)),
    Section(
        "Levels of detail", "lod", _lod_text, ("lod.md", "lod_results.md"), ("lod_pixels.png",)
    ),
    Section("What each choice is worth", "choices", _choices_text, ("choices.md",)),
)


def _section(section: Section, results: Results) -> str:
    heading = f"## {section.title}\n\n"
    if section.name not in results:
        return f"{heading}Not measured yet: run `python -m bench {section.name}`.\n"
    result = results[section.name]
    pictures = "".join(
        f"\n![{section.title}]({name})\n" for name in section.pictures if (DOCS / name).exists()
    )
    links = [f"[{name}]({name})" for name in section.documents if (DOCS / name).exists()]
    more = f" All of it: {', '.join(links)}." if links else ""
    return f"{heading}{section.text(result)}{pictures}\n{measured_line(result)}{more}\n"


def measured_line(result: dict) -> str:
    """One sentence: command, date, machine, device and versions."""
    line = origin_line(result).strip()
    if "device" in result:
        line += " On {name}, driver {driver}.".format(**result["device"])
    used = [f"{name} {version}" for name, version in result["versions"].items()]
    peers = {**result.get("codecs", {}), **result.get("peers", {})}
    return f"{line} With {', '.join([*used, *([versions(peers)] if peers else [])])}."


# --- the document ---


def report(results: Results) -> str:
    """docs/results.md."""
    sections = "\n".join(_section(section, results) for section in SECTIONS)
    headlines, others = (
        standing_table(s for s in standings(results) if s.headline == shown)
        for shown in (True, False)
    )
    models = "".join(f"* {name}: {about}\n" for name, about in PAPER_MODELS.items())
    return f"""# Results

Written by `python -m bench overview` from the measurements in bench/results. Only the claims of
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
{_figure8_section(figure8(results))}{sections}
## The models

{models}* torus, generated_*: see bench/generated.py
* beast: a character; chinesedragon, igea: scans of sculptures; engine: a CAD model of 34 \
primitives with hard edges
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


def save_figure8(bars: dict[str, dict[str, float]], path: Path) -> Path:
    """Bars on a logarithmic scale, a group per model."""
    figure, axis = grouped_bars(bars, (10, 4.2), 0.8)
    axis.set_yscale("log")
    axis.set_ylabel("milliseconds")
    axis.grid(axis="y", alpha=0.3)
    axis.legend(frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=9)
    figure.tight_layout()
    return save_figure(figure, path, bars)


def read_all() -> Results:
    names = (section.name for section in SECTIONS)
    return {name: result for name in names if (result := read_result(name)) is not None}


def draw_all() -> list[Path]:
    """docs/results.md and docs/figure8.png."""
    results = read_all()
    bars = figure8(results)
    pictures = [save_figure8(bars, DOCS / "figure8.png")] if bars else []
    print(standing_table(standings(results)))
    return [*pictures, write_document("results", report(results))]
