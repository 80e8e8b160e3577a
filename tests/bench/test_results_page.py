"""Pages and pictures are made of the committed results; the skeleton of all measurements."""

import importlib
import json
from pathlib import Path

import pytest
from PIL import Image

from bench import __main__ as bench_main
from bench import blender, common, figures, mitsuba, results_page, vulkan_raytracing
from bench.results_page import Standing

# Questions with a page of their own, and questions with a block in a page.
PAGES = ("size", "paper", "table1", "speed", "quality", "parameters", "choices")
BLOCKS = {
    "blender.md": blender.block,
    "mitsuba.md": lambda result: mitsuba.summary(result) + "\n" + common.origin_line(result),
    "vulkan-raytracing.md": vulkan_raytracing.block,
}


def test_page_is_what_the_script_makes():
    assert (common.ROOT / "docs" / "results.md").read_text() == results_page.report(
        results_page.read_all()
    )


def block_in(text: str, name: str) -> str:
    return text.split(f"<!-- begin {name} -->\n")[1].split(f"<!-- end {name} -->")[0]


@pytest.mark.parametrize("name", PAGES)
def test_page_is_made_of_its_result(name):
    result = common.read_result(name)
    assert result["script"] == f"bench.{name}"
    assert {"date", "commit", "machine", "versions"} <= result.keys()
    text = (common.DOCS / f"{name}.md").read_text()
    assert text == importlib.import_module(f"bench.{name}").report(result)
    assert f"`python -m bench.{name}`" in text


@pytest.mark.parametrize("page", BLOCKS)
def test_block_is_made_of_its_result(page):
    result = common.read_result(page.removesuffix(".md").replace("-", "_"))
    assert block_in((common.DOCS / page).read_text(), "measurements") == BLOCKS[page](result)


def test_block_replacement_keeps_the_rest(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- begin x -->\nold\n<!-- end x -->\nb\n")
    common.replace_block(page, "x", "new\n")
    assert page.read_text() == "a\n<!-- begin x -->\nnew\n<!-- end x -->\nb\n"


def test_picture_of_figure8_is_of_these_measurements():
    bars = results_page.figure8(results_page.read_all())
    with Image.open(common.ROOT / "docs" / "figure8.png") as picture:
        assert picture.text[figures.DIGEST] == figures.digest(bars)


def test_pictures_of_the_page_exist():
    docs = common.ROOT / "docs"
    page = (docs / "results.md").read_text()
    shown = [line.split("](")[1].rstrip(")") for line in page.splitlines() if line.startswith("![")]
    assert shown and all((docs / name).is_file() for name in shown)


# --- what the page says of given measurements ---


def standing(pairs, larger_wins=True):
    return Standing("question", "peer", pairs, larger_wins, ".2f", "models")


def test_the_better_one_is_named():
    assert standing([(6, 3), (8, 2)]).verdict == "ours, 3.00 times"
    assert standing([(6, 3), (8, 2)], larger_wins=False).verdict == "**peer**, 3.00 times"
    assert standing([(1, 4)]).verdict == "**peer**, 4.00 times"
    assert standing([(1, 4)], larger_wins=False).verdict == "ours, 4.00 times"
    assert standing([(100, 101)]).verdict == "even"


def test_a_row_gives_median_and_range():
    assert standing([(1, 5), (2, 5), (9, 5)]).row()[1:4] == ["2.00 (1.00 to 9.00)", "peer", "5.00"]


def test_what_is_not_measured_is_named_with_its_command():
    page = results_page.report({})
    assert all(f"`python -m bench {section.name}`" in page for section in results_page.SECTIONS)


def frame(model, path, milliseconds, **rest):
    return {
        "model": model,
        "path": path,
        "milliseconds": {"median": milliseconds, "low": 0, "high": 9},
        "resident_bytes": 1000,
        **rest,
    }


def test_frames_are_compared_model_by_model_without_culling():
    rows = [
        frame("a", "vertex", 1.0, culling=False),
        frame("a", "mesh-only", 2.0, culling=False),
        frame("b", "vertex", 10.0, culling=False),
        frame("b", "mesh-only", 30.0, culling=False),
        frame("c", "mesh-only", 5.0, culling=False),
        frame("a", "mesh-only", 0.1, culling=True),
    ]
    time, memory = results_page.standings(
        {"vulkan_raster": {"script": "bench.vulkan_raster", "width": 4, "height": 3, "rows": rows}}
    )
    assert time.pairs == [(2.0, 1.0), (30.0, 10.0)]
    assert time.verdict == "**uncompressed, indexed draw**, 2.50 times"
    assert memory.pairs == [(0.001, 0.001)] * 2 and memory.verdict == "even"
    assert (time.note, memory.note) == ("a, b; 4 x 3, unlit, no culling", "a, b")


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
    found = results_page.standings({"speed": result})
    assert [(s.what.split()[0], s.other, s.note, s.times, s.headline) for s in found] == [
        ("decoding", "meshopt-compressed glTF", "1 of the paper's; theirs to integers", 0.25, True),
        ("decoding", "Corto", "1 of the paper's", 0.5, True),
        ("encoding,", "Corto", "1 of the paper's, 2 torus", 4.0, True),
    ]


@pytest.mark.parametrize("shares", [(0, 0.25, 1), (0, 25, 100)])
def test_rays_are_compared_at_the_same_bounces_and_shares(shares):
    rows = [
        frame("a", "rt", 1 + share + bounces, cache=share, bounces=bounces)
        for share in shares
        for bounces in (0, 2)
    ]
    rows += [frame("a", "rt-triangles", 1.0 + bounces, bounces=bounces) for bounces in (0, 2)]
    found = results_page.standings(
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
        [(1 + shares[2], 1.0)],
        [(1 + shares[1], 1.0)],
    ]


def test_a_section_adds_up_memory_given_by_part():
    rows = [
        {
            **frame("a", "rt", 1.0, cache=0.25, bounces=2, group=8),
            "resident_bytes": {"buffers": 1_000_000, "cache": 500_000},
        }
    ]
    measured = {
        "script": "bench.vulkan_raytracing",
        "device": {"name": "G", "driver": "1.2"},
        "width": 4,
        "height": 3,
        "rows": rows,
    }
    page = results_page.report({"vulkan_raytracing": measured})
    assert "| rt, cache 25%, boxes of 8, 2 bounces | 1, 1.5 MB |" in page
    assert "Measured by `python -m bench.vulkan_raytracing`. On G, driver 1.2." in page


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
    result = {"script": "bench.mitsuba", "width": 4, "height": 3, "spp": 2, "runs": runs}
    depth, path, memory = results_page.standings({"mitsuba": result})
    assert (depth.times, path.times, memory.times) == pytest.approx((1 / 3, 1 / 2.25, 4))
    assert "| a, v, 25% | 3.00 | 2.25 | 0.25 |" in results_page.report({"mitsuba": result})


def test_best_of_a_row():
    assert common.best_in_bold([1.0, None, 2.0], ".1f") == ["1.0", "", "**2.0**"]
    assert common.best_in_bold([1.0, 2.0], ".1f", largest=False) == ["**1.0**", "2.0"]


# --- python -m bench ---


def test_every_question_says_what_it_asks():
    questions = bench_main.questions()
    assert {*PAGES, "mitsuba", "vulkan_decode", "results_page"} <= questions.keys()
    assert all(line.endswith((".", "?")) for line in questions.values())


def test_readme_of_the_folder_names_every_file():
    readme = (common.ROOT / "bench" / "README.md").read_text()
    for path in (common.ROOT / "bench").glob("[!_]*.py"):
        assert f"`{path.name}`" in readme


# --- the skeleton ---


@pytest.fixture
def question(tmp_path, monkeypatch):
    """A question whose results and page lie in tmp_path, and the list of its measurements."""
    monkeypatch.setattr(common, "ROOT", tmp_path)
    monkeypatch.setattr(common, "RESULTS", tmp_path / "results")
    monkeypatch.setattr(common, "DOCS", tmp_path)
    measured = []

    def measure(options):
        measured.append(options)
        return {"answer": options.answer}

    question = common.Question(
        "ultimate",
        "The first line.\nThe second.",
        measure,
        lambda result: f"answer {result['answer']}",
        lambda result: [common.write_page("ultimate", str(result["answer"]))],
        add_options=lambda parser: parser.add_argument("--answer", type=int, default=42),
        complete=lambda options: options.answer >= 0,
    )
    return question, measured


def run(question, monkeypatch, *arguments):
    monkeypatch.setattr("sys.argv", ["bench", *arguments])
    question.run()


def test_a_question_writes_result_and_page(question, monkeypatch, tmp_path, capsys):
    run(question[0], monkeypatch)
    result = json.loads((tmp_path / "results" / "ultimate.json").read_text())
    assert result["answer"] == 42 and result["script"] == "bench.ultimate"
    assert (tmp_path / "ultimate.md").read_text() == "42"
    assert capsys.readouterr().out == "answer 42\n"


@pytest.mark.parametrize("arguments", [["--no-write"], ["--answer", "-1"]])
def test_a_part_is_only_printed(question, monkeypatch, tmp_path, arguments):
    run(question[0], monkeypatch, *arguments)
    assert len(question[1]) == 1 and list(tmp_path.iterdir()) == []


def test_pages_can_be_written_without_measuring(question, monkeypatch, tmp_path):
    common.write_result("ultimate", {"answer": 7})
    run(question[0], monkeypatch, "--pages-only")
    assert question[1] == [] and (tmp_path / "ultimate.md").read_text() == "7"


def test_pages_without_a_result_are_an_error_of_one_line(question, monkeypatch):
    with pytest.raises(SystemExit, match=r"^bench ultimate: bench/results/ultimate.json is miss"):
        run(question[0], monkeypatch, "--pages-only")


def test_errors_of_a_measurement_are_one_line(question, monkeypatch):
    def fail(options):
        raise OSError("no such file")

    object.__setattr__(question[0], "measure", fail)
    with pytest.raises(SystemExit, match=r"^bench ultimate: no such file$"):
        run(question[0], monkeypatch)


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
