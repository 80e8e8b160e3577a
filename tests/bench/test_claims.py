"""Figures in the sentences of the documents are those of the committed results.

A sentence with figures of a measurement is a claim: its text with the figures left out, and where
these come from. What is left of a page without its claims and generated blocks names no graphics
card and no milliseconds, unless it is listed with the reason.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from bench.common import read_result
from bench.defaults import raw_ratio

ROOT = Path(__file__).resolve().parent.parent.parent
PAGES = (
    "README.md",
    "docs/vulkan.md",
    "docs/vulkan-raytracing.md",
    "docs/mitsuba.md",
    "docs/lod.md",
    "docs/lod_results.md",
    "docs/results.md",
)
MEASURED = re.compile(r"\bH[12]00\b|\bRTX\b|(?<![\w.])\d[\d.,]* ms\b")
PIXELS = {"1920 x 1080": "rows", "3840 x 2160": "views"}
POOL = 128_000_000
MESH_MODELS = ("suzanne", "bunny", "igea", "sponza_like", "dragon", "bistro_like", "dragon_x4")
TIMES, COUNTS = " | {:.2f}" * len(MESH_MODELS), " | {:,}" * len(MESH_MODELS)
MESH_PATHS = ("vertex", "mesh-plain", "mesh", "mesh-paper", "geometry")
GENERATED = ("layers", "ground")  # squares that fill the picture


def card(name: str) -> str:
    """H200, of the result's "NVIDIA H200"."""
    return re.search(r"\bH\d+\b", read_result(name)["device"]["name"])[0]


def flight(instances: int, unique: int, pool: int = POOL) -> dict[str, Any]:
    """The flight over so many instances of a model of so many million triangles."""
    (row,) = (
        row
        for row in read_result("vulkan_lod")["rows"]
        if (row["instances"], round(row["unique_triangles"] / 1e6)) == (instances, unique)
        and row["pool"] == pool
        and row["occlusion"]
    )
    return row["frames"]


def flights() -> list[dict[str, Any]]:
    rows = read_result("vulkan_lod")["rows"]
    return [row for row in rows if row["pool"] == POOL and row["occlusion"]]


def frame(model: str, path: str) -> dict[str, Any]:
    """The row of a picture of 1920 x 1080 pixels."""
    (row,) = (
        row
        for row in read_result("vulkan_raster")["rows"]
        if (row["model"], row["path"]) == (model, path)
    )
    return row


def drawing(model: str, path: str) -> float:
    """Median milliseconds at 1920 x 1080."""
    return frame(model, path)["milliseconds"]["median"]


def against_vertex(size: str, path: str) -> list[float]:
    """The least and the largest ratio of medians to path vertex."""
    times: dict[str, dict[str, float]] = {"vertex": {}, path: {}}
    for row in read_result("vulkan_raster")[PIXELS[size]]:
        if row.get("view", size) == size and row["path"] in times:
            times[row["path"]][row["model"]] = row["milliseconds"]["median"]
    assert times[path].keys() == times["vertex"].keys() and times[path]
    ratios = [time / times["vertex"][model] for model, time in times[path].items()]
    return [min(ratios), max(ratios)]


def pools() -> list[float]:
    """Path visibility-pool: the least and largest time at rest, dragon's, those of turning."""
    rows = [row for row in read_result("vulkan_raster")["rows"] if row["path"] == "visibility-pool"]
    rest = ends(row["milliseconds"]["median"] for row in rows)
    turning = ends(row["turning"]["median"] for row in rows)
    return [*rest, drawing("dragon", "visibility-pool"), *turning]


def from_inside() -> list[float]:
    """Path visibility over vertex: the least and largest ratio of models, those of squares."""
    times = {
        (row["model"], row["path"]): row["milliseconds"]["median"]
        for row in read_result("vulkan_raster")["views"]
        if row["view"] == "from inside"
    }
    ratios = {
        model: time / times[model, "vertex"]
        for (model, path), time in times.items()
        if path == "visibility"
    }
    squares = [ratios.pop(model) for model in GENERATED]
    return [*ends(ratios.values()), *squares]


def dearest() -> list[float]:
    """sponza_like: path visibility and vertex, the share of decoding in percent."""
    steps = frame("sponza_like", "visibility")["steps"]
    times = [drawing("sponza_like", path) for path in ("visibility", "vertex")]
    return [*times, 100 * steps["decode"] / sum(steps.values())]


def cost(path: str) -> list[float]:
    """Median milliseconds of a path, of the models of docs/vulkan.md's table."""
    return [drawing(model, path) for model in MESH_MODELS]


def meshlets(count: Callable[[dict[str, int]], int]) -> list[int]:
    """A number of meshlets for each of these models, from the counters of path mesh."""
    return [count(frame(model, "mesh")["tasks"]) for model in MESH_MODELS]


def ratios(path: str, other: str, models: Iterable[str] = ()) -> list[float]:
    """The least and the largest ratio of two paths; by default of all models."""
    every = {row["model"] for row in read_result("vulkan_raster")["rows"]}
    return ends(drawing(model, path) / drawing(model, other) for model in models or every)


def decoding(method: str) -> list[float]:
    """Median milliseconds of a decoder, for the four models that docs/vulkan.md names."""
    times = {
        row["model"]: row["milliseconds"]["median"]
        for row in read_result("vulkan_decode")["rows"]
        if row["method"] == method
    }
    return [times[model] for model in ("bunny", "igea_plain", "dragon_plain", "dragon_x4_plain")]


def traced(model: str, path: str, cache: float | None, bounces: int) -> dict[str, Any]:
    """The row of a way to trace."""
    (row,) = (
        row
        for row in read_result("vulkan_raytracing")["rows"]
        if (row["model"], row["path"], row["cache"], row["bounces"])
        == (model, path, cache, bounces)
    )
    return row


def tracing(model: str, cache: float | None, bounces: int, path: str = "rt") -> float:
    """Median milliseconds."""
    return traced(model, path, cache, bounces)["milliseconds"]["median"]


def traced_models() -> list[str]:
    return sorted({row["model"] for row in read_result("vulkan_raytracing")["rows"]})


def growing(row: dict[str, Any]) -> int:
    """Resident bytes that grow with the model."""
    return sum(size for name, size in row["resident_bytes"].items() if name != "records")


def full_cache() -> list[float]:
    """Path rt over rt-triangles: memory, time."""
    memory = [
        growing(traced(model, "rt", 1.0, 0)) / growing(traced(model, "rt-triangles", None, 0))
        for model in traced_models()
    ]
    times = [
        tracing(model, 1.0, bounces) / tracing(model, None, bounces, "rt-triangles")
        for model in traced_models()
        for bounces in (0, 2)
    ]
    return [*ends(memory), *ends(times)]


def of_full(cache: float, bounces: int) -> dict[str, float]:
    """Model -> time over that with everything cached."""
    return {
        model: tracing(model, cache, bounces) / tracing(model, 1.0, bounces)
        for model in traced_models()
    }


def quarter() -> Iterator[float]:
    yield growing(traced("dragon", "rt", 0.25, 0)) / 1e6
    for bounces in (0, 2):
        ratios = of_full(0.25, bounces)
        largest = ratios.pop("dragon_x4")
        yield from (*ends(ratios.values()), largest)


def beside_the_papers_cache() -> list[float]:
    return [
        ratio
        for bounces in (0, 2)
        for ratio in ends(
            tracing(model, 0.25, bounces, "rt-paper") / tracing(model, 0.25, bounces)
            for model in traced_models()
        )
    ]


def ends(values: Iterable[float]) -> list[float]:
    found = list(values)
    return [min(found), max(found)]


def levels() -> Iterator[float | str]:
    """Of the paragraph on levels in docs/vulkan.md."""
    yield card("vulkan_lod")
    yield from (flight(*of)["median"] for of in [(1, 1), (1, 14), (1, 105), (72, 14), (1148, 14)])
    yield max(row["frames"]["percentile_99"] for row in flights())
    yield from ends(row["frames"]["triangles"] / 1e6 for row in flights())
    first, middle, last = (flight(12, unique) for unique in (1, 14, 105))
    yield from (first["median"], middle["median"], last["median"])
    yield last["triangles"] / first["triangles"]
    yield last["clusters"] / first["clusters"]
    yield from (last["decoded"], first["decoded"])
    assert {row["frames"]["share_at_error"] for row in flights()} == {1.0}
    small = flight(72, 14, 32_000_000)
    yield from (100 * small["share_at_error"], small["worst_allowed"])
    large = [row["frames"] for row in flights() if row["unique_triangles"] > 10_000_000]
    yield from ends(frames["read_bytes"] / 1e6 for frames in large)
    yield from ends(100 * frames["share_complete"] for frames in large)
    yield from ends(round(1000 * row["first_seconds"], -1) for row in flights())


# Page -> claims: (text with a place for each figure, what gives the figures).
CLAIMS: dict[str, list[tuple[str, Callable[[], Any]]]] = {
    "README.md": [
        (
            "stores them in 1/{:.1f} of the raw size at the bits that it chooses",
            lambda: [raw_ratio(read_result("defaults")["rows"])],
        ),
        (
            "GPU times were measured on NVIDIA's GPUs: drawing on an {}, decoding on an {}, "
            "levels of detail on an {}, ray tracing on an {}.",
            lambda: map(
                card, ("vulkan_raster", "vulkan_decode", "vulkan_lod", "vulkan_raytracing")
            ),
        ),
    ],
    "docs/vulkan.md": [
        ("On an NVIDIA {}:", lambda: [card("vulkan_raster")]),
        (
            "it takes {:.2f} to {:.2f} times the time of `vertex` at 1920 x 1080 and {:.2f} to "
            "{:.2f} times at 3840 x 2160 on the twelve models.",
            lambda: [ratio for size in PIXELS for ratio in against_vertex(size, "visibility")],
        ),
        (
            "dragon takes {:.2f} ms (`vertex` {:.2f})",
            lambda: [drawing("dragon", path) for path in ("visibility", "vertex")],
        ),
        (
            "The gain is least for sponza_like ({:.3f} against {:.3f} ms), because the boundaries "
            "of its meshlets have many seams: decoding takes {:.0f} % of its frame.",
            dearest,
        ),
        (
            "{:.1f} to {:.1f} times the time of `vertex`. Larger models",
            lambda: against_vertex("1920 x 1080", "stream"),
        ),
        (
            "3.5 million triangles take {:.1f} ms, as with `vertex`; `mesh-plain` takes {:.1f}.",
            lambda: [drawing("dragon_x4", path) for path in ("stream", "mesh-plain")],
        ),
        (
            "on an NVIDIA {}, 300 frames of a flight at one pixel of error, in a pool of 128 MB in "
            "all, take {:.2f} ms for 1 million triangles, {:.2f} for 14 "
            "million, {:.2f} for 105 million, {:.2f} for 72 instances with a billion, and {:.2f} "
            "for 1,148 with 16 billion (medians; 99 of 100 frames at most {:.1f} ms). The views "
            "draw {:.1f} to {:.1f} million triangles. Twelve instances of models of 0.9, 14 and "
            "105 million triangles look alike: 10 million take {:.2f} ms, 167 million {:.2f}, 1.3 "
            "billion {:.2f}. The last draws {:.1f} times the triangles of the first at the same "
            "error, in {:.1f} times the clusters, but decodes {:.0f} clusters a frame where the "
            "first decodes {:.0f}. All frames allowed one pixel; smaller pools allow more error: "
            "with 32 MB for a billion triangles {:.0f} % of the frames allow one pixel, the "
            "worst {:.1f}. What late pages showed was not measured then. From 14 million triangles "
            "on, {:.0f} to {:.0f} MB are read, and "
            "{:.0f} to {:.0f} % of the frames lack no page; the others show coarser clusters in "
            "their place. The first picture takes {:.0f} to {:.0f} ms.",
            levels,
        ),
        ("The {} is a compute device", lambda: [card("vulkan_raster")]),
        (
            "a camera at rest takes {:.2f} to {:.2f} ms, dragon {:.2f}. A camera that turns a "
            "degree a frame takes {:.2f} to {:.2f} ms.",
            pools,
        ),
        (
            "from inside, `visibility` takes {:.2f} to {:.2f} times the time of `vertex`. Seven "
            "squares that fill the picture take {:.2f} times, a floor and a ceiling {:.2f}.",
            from_inside,
        ),
        *((f"| `{path}`{TIMES} |", partial(cost, path)) for path in MESH_PATHS),
        (f"| meshlets: tested{COUNTS} |", lambda: meshlets(lambda tasks: tasks["tested"])),
        (
            f"| in view, facing the eye{COUNTS} |",
            lambda: meshlets(lambda tasks: tasks["launched"] + tasks["hidden"]),
        ),
        (
            f"| not hidden: launched{COUNTS} |",
            lambda: meshlets(lambda tasks: tasks["launched"]),
        ),
        (
            "`mesh` takes {:.0f} to {:.0f} times as long as `mesh-plain`, `mesh-paper` {:.0f} "
            "to {:.0f} times.",
            lambda: [*ratios("mesh", "mesh-plain"), *ratios("mesh-paper", "mesh-plain")],
        ),
        (
            "**`geometry`** is {:.0f} to {:.0f} times slower than `mesh` and `mesh-paper`.",
            lambda: ends([*ratios("geometry", "mesh"), *ratios("geometry", "mesh-paper")]),
        ),
        (
            "`mesh-paper` here {:.1f} to {:.1f} times.",
            lambda: ratios("geometry", "mesh-paper", ("suzanne", "dragon")),
        ),
        (
            "as in `stream`, takes on an NVIDIA {} {:.2f} ms for bunny (1,108 meshlets), {:.2f} "
            "for igea (4,381), "
            "{:.2f} for dragon (14,227) and {:.2f} for 3.5 million triangles (56,884). With "
            "parallel connectivity, as in `mesh` and ray tracing, it takes {:.2f}, {:.2f}, {:.2f} "
            "and {:.2f};",
            lambda: [card("vulkan_decode"), *decoding("team"), *decoding("parallel")],
        ),
        ("The serial decoder takes {:.2f}, {:.2f}, {:.2f} and {:.2f}:", lambda: decoding("serial")),
        (
            "(`interior`: {:.2f}, {:.2f}, {:.2f} and {:.2f} ms)",
            lambda: decoding("interior"),
        ),
        (
            "(`traversal`: {:.2f}, {:.2f}, {:.2f} and {:.2f} ms, 5.5 billion",
            lambda: decoding("traversal"),
        ),
    ],
    "docs/vulkan-raytracing.md": [
        (
            "50 % of sponza_like ({:.2f} ms, 3.22 were allowed) and of dragon ({:.2f} ms, 3.71 "
            "were allowed)",
            lambda: [tracing(model, 0.5, 2) for model in ("sponza_like", "dragon")],
        ),
        ("{:.2f} ms for a full cache", lambda: [tracing("dragon_x4", 1.0, 0)]),
        (
            "a scene takes {:.2f} to {:.2f} of the memory of `rt-triangles` at {:.1f} to {:.1f} "
            "times its frame time.",
            full_cache,
        ),
        (
            "(dragon {:.1f} MB, a seventh of `rt-triangles`), first hits take {:.1f} to {:.1f} "
            "times as long (dragon_x4 {:.1f}), two bounces {:.1f} to {:.1f} times (dragon_x4 "
            "{:.1f}).",
            quarter,
        ),
        (
            "25 % is {:.0f} to {:.0f} times faster in first hits, {:.0f} to {:.0f} times with "
            "bounces.",
            beside_the_papers_cache,
        ),
        (
            "First hits with 50 % take {:.1f} to {:.1f} times a full cache.",
            lambda: ends(of_full(0.5, 0).values()),
        ),
    ],
}
# Figures that no committed result has, with their source.
OTHERS = {
    "docs/vulkan.md": [
        # Published by their authors.
        "colossus 1.0 publishes 1.51 ms for 15.9 billion triangles (RX 9070 XT), Bevy 3.5 ms for "
        "115 billion (RTX 4070, all in memory)",
        # The machine of the paper.
        "RTX 2070 Mobile, a GPU that draws with all of its multiprocessors",
        # Seen once, by measuring the steps of single frames.
        "The depth copy and the pyramid take 0.12 ms.",
        "takes 21 ms by `mesh`, 17 by `mesh-paper` and 0.3 by `visibility`",
        # Seen once, with other sizes of the ring.
        "take 2.0 ms with 8,192 slots",
        "bistro_like takes 1.46 ms in two",
        "the same model takes 3.7 ms and 9.7 MB",
        # Seen once, with shaders that are not measured by themselves.
        "an empty picture takes 0.4 ms and decoding a batch at least 0.1 to 0.25 ms",
        "3.7 ms for 3.5 million triangles as a compute shader and 110 ms as a mesh shader",
    ],
    "docs/vulkan-raytracing.md": [
        # The bound that the rows are compared with.
        'is not "missed" if it takes at most a full cache and 0.3 ms for each pass',
        "even with a full cache and 0.3 ms for each pass",
        # Computed from the number of meshlets and a rate.
        "a first hit costs 0.57 ms for it",
        "a decoding, 0.25 ms each, beside",
    ],
}


def prose(page: str) -> str:
    """The page without what scripts write, on one line."""
    text = (ROOT / page).read_text()
    if re.search(r"^(Measured|Written) by", text, re.M) and "<!-- begin" not in text:
        return ""
    text = re.sub(r"<!-- begin.*?<!-- end[^>]*>", "", text, flags=re.S)
    return " ".join(text.split())


def wrong_claims(page: str, text: str) -> list[str]:
    """The claims with today's figures that the text does not have."""
    claims = [template.format(*figures()) for template, figures in CLAIMS.get(page, [])]
    return [claim for claim in claims if claim not in text]


def unclaimed(page: str, text: str) -> list[str]:
    """Figures of the text that are in no claim, with the words around them."""
    for template, figures in CLAIMS.get(page, []):
        text = text.replace(template.format(*figures()), "")
    for known in OTHERS.get(page, []):
        assert known in text
        text = text.replace(known, "")
    return [text[max(m.start() - 60, 0) : m.end() + 40] for m in MEASURED.finditer(text)]


@pytest.mark.parametrize("page", PAGES)
def test_claims_are_those_of_the_results(page):
    assert wrong_claims(page, prose(page)) == []


@pytest.mark.parametrize("page", PAGES)
def test_all_measured_figures_are_claims(page):
    assert unclaimed(page, prose(page)) == []


@pytest.mark.parametrize(
    ("page", "right", "wrong"),
    [
        ("README.md", "ray tracing on an H100", "ray tracing on an H200"),
        ("docs/vulkan.md", "takes on an NVIDIA H200 0.19", "takes on an NVIDIA H100 0.19"),
        ("docs/vulkan.md", "0.42 for 72 instances", "0.49 for 72 instances"),
        ("docs/vulkan.md", "dragon takes 0.38 ms", "dragon takes 0.39 ms"),
    ],
)
def test_a_wrong_card_or_median_is_noticed(page, right, wrong):
    text = prose(page)
    assert right in text
    changed = text.replace(right, wrong)
    assert wrong_claims(page, changed) and unclaimed(page, changed)
