"""Where do we stand? One document from all committed measurements.

Reads bench/results/*.json and measures nothing. Writes docs/results.md.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from bench import vulkan_decode, vulkan_raster
from bench.common import (
    DOCS,
    bullets,
    megabytes,
    milliseconds,
    origin_line,
    pixels,
    read_result,
    table,
    versions,
)
from bench.mitsuba import INTEGRATORS, NATIVE, TRIANGLES, kind_of, outdated
from bench.models import PAPER_MODELS

OURS, PAPER = "ours", "the paper's encoding"
CLAIMED_RATIO = (4.26, 4.35)  # section 7 of the paper, of its models
EVEN = 0.02  # a ratio this close to 1 counts as even
NATIVE_MESH = "Mitsuba's own mesh"
PATHS = ("visibility", "stream", "mesh")  # of the raster paths, those that are compared
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
    made = (make(results[name]) for name, make in makers.items() if name in results)
    return [standing for of_result in made for standing in of_result if standing.pairs]


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


def _paired(ours: list[dict], theirs: list[dict], value: Callable[[dict], float]) -> Pairs:
    """The pairs of the models that both have."""
    others = {row["model"]: value(row) for row in theirs}
    return [
        (row["model"], (value(row), others[row["model"]])) for row in ours if row["model"] in others
    ]


def _of_path(rows: list[dict], path: str) -> list[dict]:
    return [row for row in rows if row["path"] == path]


def _raster_standings(result: dict) -> Iterator[Standing]:
    rows = result["rows"]
    others = {
        "vertex": "uncompressed, indexed draw",
        "mesh-plain": "uncompressed, mesh shader",
        "geometry": "compressed, geometry shader",
    }
    for path in PATHS:
        for other, name in others.items():
            yield _standing(
                f"frame on the GPU, path `{path}`, ms",
                name,
                _paired(_of_path(rows, path), _of_path(rows, other), milliseconds),
                f"; {pixels(result)}, lit, culling",
                headline=path == "visibility" and other != "geometry",
            )
    for path in PATHS:
        pairs = _paired(_of_path(rows, path), _of_path(rows, "vertex"), megabytes)
        what = f"resident on the GPU, path `{path}`, MB"
        yield _standing(what, others["vertex"], pairs, headline=True)


def _raytracing_standings(result: dict) -> Iterator[Standing]:
    rows = result["rows"]
    for cache in (1, 0.25):
        ours = [row for row in _of_path(rows, "rt") if row["cache"] == cache]
        bounces = min((row["bounces"] for row in ours), default=0)
        ours, theirs = (
            [row for row in chosen if row["bounces"] == bounces]
            for chosen in (ours, _of_path(rows, "rt-triangles"))
        )
        for unit, value in (("ms", milliseconds), ("MB", megabytes)):
            yield _standing(
                f"ray tracing on the GPU, {cache:.0%} cached, {unit}",
                "uncompressed, the driver's triangles",
                _paired(ours, theirs, value),
                f"; {pixels(result)}, {bounces} bounces",
                headline=cache == 1,
            )


def mitsuba_rows(result: dict, task: str) -> dict[tuple[str, str], dict[str, dict]]:
    """Rows of one task ("time", "memory"), by model and variant and then by kind of shape.

    Only rows of the default policy.
    """
    # Reversed: the rows of the default policy come first, and replace those of the others.
    return {
        (run["model"], run["variant"]): {kind_of(row): row for row in reversed(run["rows"])}
        for run in result["runs"]
        if run["task"] == task
    }


def _times_native(row: dict, native: dict, integrator: str) -> float:
    """Time over that of Mitsuba's own mesh: the median ratio of the rounds if the result has it."""
    return row.get(f"{integrator}_ratio", row[integrator] / native[integrator])


def _mitsuba_standings(result: dict) -> Iterator[Standing]:
    times, memory = mitsuba_rows(result, "time"), mitsuba_rows(result, "memory")
    note = " (outdated, see below)" if outdated(result) else ""

    shown = {TRIANGLES: "triangles", "cache 100%": "100% cached", "cache 25%": "25% cached"}

    def paired(of_task: dict, variant: str, kind: str, figures: Callable) -> Pairs:
        return [
            (model, figures(rows[kind], rows[NATIVE]))
            for (model, of), rows in of_task.items()
            if of == variant and {kind, NATIVE} <= rows.keys()
        ]

    for variant in dict.fromkeys(variant for _, variant in times):
        for kind, words in shown.items():
            for name in INTEGRATORS:

                def seconds(row: dict, native: dict, name=name) -> tuple[float, float]:
                    return _times_native(row, native, name) * native[name], native[name]

                yield _standing(
                    f"Mitsuba {variant}, {name}, {words}, s"
                    + (note if kind == "cache 25%" else ""),
                    NATIVE_MESH,
                    paired(times, variant, kind, seconds),
                    headline=kind != "cache 100%" and name == "path",
                )
        for kind in (TRIANGLES, "cache 25%"):
            yield _standing(
                f"Mitsuba {variant}, memory, {shown[kind]}, MB",
                NATIVE_MESH,
                paired(memory, variant, kind, lambda r, n: (r["bytes"] / 1e6, n["bytes"] / 1e6)),
                headline=True,
            )


# --- sections ---


@dataclass(frozen=True)
class Section:
    """One question of the document.

    name: of its result
    documents: names of files in docs that show the whole result
    text: makes a table from the result, for those whose documents show none
    """

    title: str
    name: str
    documents: tuple[str, ...]
    text: Callable[[dict], str] | None = None


SECTIONS = (
    Section("Size", "size", ("size.md",)),
    Section("The paper's encoding", "paper", ("paper.md",)),
    Section("The paper's Table 1", "table1", ("table1.md",)),
    Section("Speed on the CPU", "speed", ("speed.md",)),
    Section("Reading other formats", "reading", ("scale.md",)),
    Section("Many models", "batch", ("scale.md",)),
    Section("Many small models", "batch_small", ("scale.md",)),
    Section("Memory of many models", "batch_memory", ("scale.md",)),
    Section("Quality", "quality", ("quality.md",)),
    Section("Bits that are chosen", "defaults", ("defaults.md",)),
    Section("Decoding on the GPU", "vulkan_decode", ("vulkan.md",), vulkan_decode.summary),
    Section("Drawing on the GPU", "vulkan_raster", ("vulkan.md",), vulkan_raster.summary),
    Section("Levels of detail on the GPU", "vulkan_lod", ("vulkan.md",)),
    Section("Ray tracing on the GPU", "vulkan_raytracing", ("vulkan-raytracing.md",)),
    Section("Ray tracing with Mitsuba", "mitsuba", ("mitsuba.md",), outdated),
    Section("Levels of detail in Mitsuba", "lod_mitsuba", ("mitsuba.md",)),
    Section("Importing into Blender", "blender", ("blender.md",)),
    Section("Parameters", "parameters", ("parameters.md",)),
    Section("Levels of detail", "lod", ("lod.md", "lod_results.md")),
    Section("What each choice is worth", "choices", ("choices.md",)),
)


def _section(section: Section, results: Results) -> str:
    heading = f"### {section.title}\n\n"
    if section.name not in results:
        return f"{heading}Not measured yet: run `python -m bench {section.name}`.\n"
    result = results[section.name]
    links = [f"[{name}]({name})" for name in section.documents if (DOCS / name).exists()]
    text = section.text(result) if section.text else ""
    text += "\n" if text else ""
    return f"{heading}{text}{', '.join(links)}: {measured_line(result)}\n"


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
## The measurements

{sections}
## The models

{bullets(PAPER_MODELS)}* torus, generated_*: see bench/generated.py
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


def read_all() -> Results:
    names = (section.name for section in SECTIONS)
    return {name: result for name in names if (result := read_result(name)) is not None}


def draw_all() -> list[Path]:
    """docs/results.md."""
    results = read_all()
    print(standing_table(standings(results)))
    path = DOCS / "results.md"
    path.write_text(report(results))
    return [path]
