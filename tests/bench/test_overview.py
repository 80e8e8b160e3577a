"""Documents and pictures are made of the committed results; the skeleton of all measurements."""

import importlib
import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from bench import __main__ as bench_main
from bench import blender, common, mitsuba, overview, vulkan_raytracing, web
from bench.overview import Standing

# Questions with a document of their own, and questions with a block in one.
DOCUMENTS = ("size", "paper", "table1", "speed", "quality", "parameters", "choices")
BLOCKS = {
    "blender.md": blender.block,
    "mitsuba.md": mitsuba.block,
    "vulkan-raytracing.md": vulkan_raytracing.block,
    "web.md": web.block,
}
ORIGIN = {
    "script": "bench.x",
    "date": "2026-01-01T00:00:00+00:00",
    "commit": "abc",
    "machine": {"cpu": "CPU", "cores": 2},
    "versions": {"numpy": "2.0"},
}


def test_page_is_what_the_script_makes():
    assert (common.ROOT / "docs" / "results.md").read_text() == overview.report(overview.read_all())


def block_in(text: str, name: str) -> str:
    return text.split(f"<!-- begin {name} -->\n")[1].split(f"<!-- end {name} -->")[0]


@pytest.mark.parametrize("name", DOCUMENTS)
def test_page_is_made_of_its_result(name):
    result = common.read_result(name)
    assert result["script"] == f"bench.{name}"
    assert {"date", "commit", "machine", "versions"} <= result.keys()
    text = (common.DOCS / f"{name}.md").read_text()
    assert text == importlib.import_module(f"bench.{name}").report(result)
    assert f"`python -m bench {name}`" in text


@pytest.mark.parametrize("page", BLOCKS)
def test_block_is_made_of_its_result(page):
    result = common.read_result(page.removesuffix(".md").replace("-", "_"))
    assert block_in((common.DOCS / page).read_text(), "measurements") == BLOCKS[page](result)


def test_block_replacement_keeps_the_rest(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- begin x -->\nold\n<!-- end x -->\nb\n")
    common.replace_block(page, "x", "new\n")
    assert page.read_text() == "a\n<!-- begin x -->\nnew\n<!-- end x -->\nb\n"


# --- what the page says of given measurements ---


def standing(pairs, larger_wins=True):
    return Standing("question", "peer", pairs, "models", larger_wins=larger_wins, form=".2f")


def test_the_better_one_is_named():
    assert standing([(6, 3), (8, 2)]).verdict == "ours, 3.00 times"
    assert standing([(6, 3), (8, 2)], larger_wins=False).verdict == "**peer**, 3.00 times"
    assert standing([(1, 4)]).verdict == "**peer**, 4.00 times"
    assert standing([(1, 4)], larger_wins=False).verdict == "ours, 4.00 times"
    assert standing([(100, 101)]).verdict == "even"


def test_a_row_gives_median_and_range():
    row = overview.standing_table([standing([(1, 5), (2, 5), (9, 5)])]).splitlines()[2]
    assert row.startswith("| question | 2.00 (1.00 to 9.00) | peer | 5.00 | **peer**, ")


def test_what_is_not_measured_is_named_with_its_command():
    page = overview.report({})
    assert all(f"`python -m bench {section.name}`" in page for section in overview.SECTIONS)


def frame(model, path, milliseconds, **rest):
    return {
        "model": model,
        "path": path,
        "milliseconds": {"median": milliseconds, "low": 0, "high": 9},
        "resident_bytes": 1000,
        **rest,
    }


def test_frames_are_compared_model_by_model_as_render_draws_them():
    rows = [
        frame("a", "vertex", 1.0),
        frame("a", "mesh", 2.0),
        frame("b", "vertex", 10.0),
        frame("b", "mesh", 30.0),
        frame("c", "mesh", 5.0),
    ]
    time, memory = overview.standings(
        {"vulkan_raster": {"script": "bench.vulkan_raster", "width": 4, "height": 3, "rows": rows}}
    )
    assert time.pairs == [(2.0, 1.0), (30.0, 10.0)]
    assert time.verdict == "**uncompressed, indexed draw**, 2.50 times"
    assert memory.pairs == [(0.001, 0.001)] * 2 and memory.verdict == "even"
    assert (time.note, memory.note) == ("a, b; 4 x 3, lit, culling", "a, b")


def test_decoding_is_of_the_papers_models_and_encoding_of_the_large_ones():
    def row(model, triangles, seconds, *tasks):
        of = {
            codec: {"seconds": {"median": spent}}
            for codec, spent in (
                ("ours", seconds),
                ("meshopt-compressed glTF", 2.0),
                ("Corto", 4.0),
            )
        }
        return {"model": model, "triangles": triangles, **dict.fromkeys(tasks, of)}

    models = (("torus", 49_999), ("torus", 50_000), ("torus", 60_000), ("bunny", 70_000))
    series = [row(model, triangles, 1.0, "decode", "encode") for model, triangles in models]
    result = {
        "script": "bench.speed",
        "models": series,
        "paper_models": [row("suzanne", 80_000, 8.0, "decode")],
    }
    found = overview.standings({"speed": result})
    assert [(s.what.split()[0], s.other, s.note, s.times, s.headline) for s in found] == [
        ("decoding", "meshopt-compressed glTF", "1 of the paper's; theirs to integers", 0.25, True),
        ("decoding", "Corto", "1 of the paper's", 0.5, True),
        ("encoding,", "Corto", "1 of the paper's, 2 torus", 4.0, True),
    ]


def test_rays_are_compared_at_the_same_bounces_and_shares():
    rows = [
        frame("a", "rt", 1 + share + bounces, cache=share, bounces=bounces)
        for share in (0, 0.25, 1)
        for bounces in (0, 2)
    ]
    rows += [frame("a", "rt-triangles", 1.0 + bounces, bounces=bounces) for bounces in (0, 2)]
    found = overview.standings(
        {
            "vulkan_raytracing": {
                "script": "bench.vulkan_raytracing",
                "width": 4,
                "height": 3,
                "rows": rows,
            }
        }
    )
    assert [s.pairs for s in found if s.what.endswith("ms")] == [
        [(2, 1.0)],
        [(1.25, 1.0)],
    ]


def test_a_section_adds_up_memory_given_by_use():
    row = {
        **frame("a", "stream", 1.0),
        "resident_bytes": {"buffers": 1_000_000, "slots": 500_000},
    }
    pooled = {**frame("a", "visibility-pool", 1.0), "pool": 5}
    pooled |= {"turning": {"median": 0.75}, "steps": {"occlusion": 0.125}}
    measured = {
        **ORIGIN,
        "device": {"name": "G", "driver": "1.2"},
        "width": 4,
        "height": 3,
        "rows": [row, pooled],
        "views": [],
    }
    page = overview.report({"vulkan_raster": measured})
    assert "| stream | 1, 1.5 MB |" in page
    assert "| visibility-pool | 0.75 |" in page
    assert "| occlusion, with a pool | 0.125 |" in page
    assert "`python -m bench x` on 2026-01-01 at commit abc, CPU, 2 cores. On G, driver" in page
    assert "driver 1.2. With numpy 2.0." in page


def test_mitsuba_is_compared_by_the_ratios_of_its_rounds_where_they_are_kept():
    native = {"fraction": None, "depth": 1.0, "path": 2.0}
    cached = {"fraction": 0.25, "policy": "counts", "depth": 3.0, "path": 5.0, "path_ratio": 2.25}
    other_policy = {**cached, "policy": "clock", "depth": 99.0}
    runs = [
        {"model": "a", "variant": "v", "task": "time", "rows": [native, cached, other_policy]},
        {
            "model": "a",
            "variant": "v",
            "task": "memory",
            "rows": [{"fraction": None, "bytes": 4e6}, {"fraction": 0.25, "bytes": 1e6}],
        },
    ]
    result = {**ORIGIN, "width": 4, "height": 3, "spp": 2, "runs": runs}
    depth, path, memory = overview.standings({"mitsuba": result})
    assert (depth.times, path.times, memory.times) == pytest.approx((1 / 3, 1 / 2.25, 4))


def test_best_of_a_row():
    assert common.best_in_bold([1.0, None, 2.0], ".1f") == ["1.0", "", "**2.0**"]
    assert common.best_in_bold([1.0, 2.0], ".1f", largest=False) == ["**1.0**", "2.0"]


# --- python -m bench ---


def test_every_question_says_what_it_asks():
    questions = bench_main.questions()
    assert {*DOCUMENTS, "mitsuba", "vulkan_decode", "overview"} <= questions.keys()
    assert all(line.endswith((".", "?")) for line in questions.values())


def test_readme_of_the_folder_names_every_file():
    readme = (common.ROOT / "bench" / "README.md").read_text()
    for path in (common.ROOT / "bench").glob("[!_]*.py"):
        assert f"`{path.name}`" in readme


# --- the skeleton ---


@pytest.fixture
def question(tmp_path, monkeypatch):
    """A question whose results and document lie in tmp_path; `asked` lists its measurements."""
    monkeypatch.setattr(common, "ROOT", tmp_path)
    monkeypatch.setattr(common, "RESULTS", tmp_path / "results")
    monkeypatch.setattr(common, "DOCS", tmp_path)
    asked = []

    def measure(options):
        asked.append(options)
        return {"answer": options.answer}

    return SimpleNamespace(
        __name__="bench.the_ultimate",
        __doc__="The first line.\nThe second.",
        asked=asked,
        measure=measure,
        report=lambda result: str(result["answer"]),
        save_plot=lambda result, path: path,
        add_options=lambda parser: parser.add_argument("--answer", type=int, default=42),
        PARTS=("answer",),
    )


def test_a_question_writes_result_and_document(question, tmp_path, capsys):
    common.answer(question, [])
    result = json.loads((tmp_path / "results" / "the_ultimate.json").read_text())
    assert result["answer"] == 42 and result["script"] == "bench.the_ultimate"
    assert (tmp_path / "the-ultimate.md").read_text() == "42"
    output = capsys.readouterr()
    assert output.out == "42\n"
    written = [line.split("wrote ")[1] for line in output.err.splitlines()]
    assert written == ["results/the_ultimate.json", "the-ultimate.png", "the-ultimate.md"]


@pytest.mark.parametrize("arguments", [["--no-write"], ["--answer", "-1"]])
def test_a_part_is_only_printed(question, tmp_path, arguments):
    common.answer(question, arguments)
    assert len(question.asked) == 1 and list(tmp_path.iterdir()) == []


def test_documents_can_be_written_without_measuring(question, tmp_path):
    common.write_result("the_ultimate", {"answer": 7})
    common.answer(question, ["--docs-only"])
    assert question.asked == [] and (tmp_path / "the-ultimate.md").read_text() == "7"


def test_documents_without_a_result_are_an_error_of_one_line(question):
    with pytest.raises(SystemExit, match=r"^bench the_ultimate: bench/results/the_ult"):
        common.answer(question, ["--docs-only"])


def test_errors_of_a_measurement_are_one_line(question):
    def fail(options):
        raise OSError("no such file")

    question.measure = fail
    with pytest.raises(SystemExit, match=r"^bench the_ultimate: no such file$"):
        common.answer(question, [])


def test_functions_run_in_a_process_of_their_own():
    folder = common.call_in_process("os.path", "join", "a", "b")
    assert Path(folder) == Path("a/b")
    with pytest.raises(SystemExit, match=r"os\.chdir failed"):
        common.call_in_process("os", "chdir", "/no such folder")


def test_unknown_question_is_one_line(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["bench", "sped"])
    assert bench_main.main() == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_missing_package_is_one_line():
    with pytest.raises(
        SystemExit, match=r"^bench: no-such-package is not installed; pip install no-such-package$"
    ):
        common.origin("bench.speed", ("no-such-package",))
