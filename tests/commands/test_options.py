"""The options of compress: one declaration for Python, the command line and the documentation."""

import argparse
import base64
import dataclasses
import inspect
import io
import re

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_ext import _codec
from gltf_ext.document.container import read_document
from gltf_ext.options import OPTIONS, Options, _declare
from gltf_meshlet import cli
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import Builder, grid_mesh, write_grid
from tools.option_docs import BLOCKS


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.path.name)
def test_documentation_is_current(block):
    assert block.path.read_text() == block.current(), "run python -m tools.option_docs"


def test_the_docstring_names_every_option():
    text = inspect.getdoc(gltf_ext.compress)
    named = re.findall(r"^    (\w+): ", text.partition("Options:")[2].partition("Returns")[0], re.M)
    assert named == [option.name for option in OPTIONS]


def test_the_signature_has_every_option_with_its_default():
    parameters = inspect.signature(gltf_ext.compress).parameters
    assert list(parameters)[:2] == ["input", "output"]
    keywords = {name: p.default for name, p in list(parameters.items())[2:]}
    assert keywords == {
        option.name: Options.__dataclass_fields__[option.name].default for option in OPTIONS
    }
    assert all(p.kind == p.KEYWORD_ONLY for p in list(parameters.values())[2:])


def test_type_checkers_see_the_options(tmp_path):
    """Wrong names and types of options are errors for a type checker, right ones are none."""
    api = pytest.importorskip("mypy.api", reason="mypy is not installed; make lint")
    source = tmp_path / "user.py"
    source.write_text(
        "import gltf_ext\n"
        "gltf_ext.compress('a.obj', 'b.glb', position_bits=14, effort='fast', lod=True)\n"
        "gltf_ext.compress('a.obj', 'b.glb', positon_bits=14)\n"
        "gltf_ext.compress('a.obj', 'b.glb', lod='no')\n"
        "gltf_ext.compress('a.obj', 'b.glb', effort='slow')\n"
        "gltf_ext.compress()\n"
        "gltf_ext.compress('a.obj')\n"
    )
    options = ("--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(tmp_path))
    output, _, _ = api.run([*options, str(source)])
    lines = re.findall(r"user\.py:(\d+): error", output)
    assert lines == ["3", "4", "5", "6"], output


def test_the_command_line_has_every_option_but_progress():
    actions = cli._parser()._actions
    (commands,) = (a for a in actions if isinstance(a, argparse._SubParsersAction))
    command = commands.choices["compress"]
    command.complete()
    flags = {flag for action in command._actions for flag in action.option_strings}
    assert flags - {"-h", "--help"} == {o.flag for o in OPTIONS if o.name != "progress"}


def test_shown_defaults_are_the_defaults():
    options = Options()
    for option in OPTIONS:
        value = getattr(options, option.name)
        if value is not None and not isinstance(value, bool):
            assert option.default == str(value), option.name


def test_shown_defaults_are_the_encoders(tmp_path):
    """lambda_ is left to the encoder."""
    positions, triangles = grid_mesh(40, 40)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    original = builder.write(tmp_path / "in.glb")
    outputs = []
    shown = {
        o.name: o.from_text(o.default) for o in OPTIONS if o.default and o.type in (int, float)
    }
    assert "lambda_" in shown
    for options in ({}, shown, {**shown, "lambda_": 3.0}):
        gltf_ext.compress(original, tmp_path / "out.glb", **options)
        outputs.append((tmp_path / "out.glb").read_bytes())
    assert outputs[0] == outputs[1] != outputs[2]


def test_an_option_without_default_names_its_type():
    with pytest.raises(TypeError, match="--new has no default, so name its type"):
        _declare(None, "--new", "a new option")


@pytest.mark.parametrize("option", [o for o in OPTIONS if o.limits], ids=lambda o: o.name)
def test_limits(option):
    low, high = option.limits
    for value in (low, high):
        Options(**{option.name: option.type(value)})
    for value in (low - 1, high + 1, "4", np.nan, True):
        with pytest.raises(gltf_ext.MeshletError, match=f"{option.name} is .*; use {low:g} to"):
            Options(**{option.name: value})


@pytest.mark.parametrize(
    "values", [{"lambda_": 0}, {"step": "1"}, {"lambda_": -1.0}, {"lod_limit": True}]
)
def test_numbers_above_zero(values):
    with pytest.raises(gltf_ext.MeshletError, match="use a number above 0 and up to"):
        Options(**values)


def test_lambda_ends_where_the_encoders_does(tmp_path):
    positions, triangles = grid_mesh(9, 9)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    original = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(original, tmp_path / "out.glb", lambda_=1000)
    with pytest.raises(gltf_ext.MeshletError, match=r"lambda_ is 1001; .* up to 1000"):
        Options(lambda_=1001)
    ids, grid = (
        np.arange(len(positions), dtype=np.uint32),
        _codec.Stream(_codec.KIND_GRID, 3, 12, 1.0),
    )
    values = [np.zeros((len(positions), 3), np.uint32)]
    with pytest.raises(ValueError, match="lambda is above 1000"):
        _codec.encode(triangles, ids, positions, [grid], values, lambda_=1001)


# Of each type of option, what is not of that type.
WRONG = {
    bool: ["no", "", 1, 0.0, np.array([1, 2])],
    int: ["4", 4.0, True, np.array([4, 5])],
    float: ["4", True, [1.0]],
    str: [True, 2.5, b"mesh", ["mesh"], np.array(["mesh", "scene"])],
}


@pytest.mark.parametrize("option", OPTIONS, ids=lambda option: option.name)
def test_every_option_refuses_what_it_cannot_have(option):
    """The error names the option, the value and what is accepted."""
    wrong = [*WRONG[option.type], *([] if option.optional else [None])]
    for value in wrong:
        with pytest.raises(gltf_ext.MeshletError) as caught:
            Options.of({option.name: value})
        assert str(caught.value).startswith(f"{option.name} is ")
        assert str(caught.value).endswith(f"; use {option.accepted}") and option.accepted
        assert caught.value.options == (option.name,)


@pytest.mark.parametrize("option", OPTIONS, ids=lambda option: option.name)
def test_none_is_the_default_or_refused(option):
    (field,) = (f for f in dataclasses.fields(Options) if f.name == option.name)
    assert option.optional == (field.default is None)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda i, o: gltf_ext.compress(i, o, lod="no"), "lod is 'no'; use True or False"),
        (lambda i, o: gltf_ext.batch(str(i), str(o), lod="no"), "lod is 'no'; use True or False"),
        (lambda i, o: gltf_ext.batch(str(i), str(o), workers=0), "workers is 0; use 1 or more"),
        (lambda i, o: gltf_ext.batch(str(i), str(o), workers="2"), "workers is '2'; use 1 or more"),
        (
            lambda i, o: gltf_ext.batch(str(i), str(o), scheduler=5),
            "scheduler is 5; use an address",
        ),
        (lambda i, o: gltf_ext.transcode(i, o, threads="2"), "threads is '2'; use 0 to 1024"),
        (lambda i, o: gltf_ext.verify(i, o, progress=1), "progress is 1; use True or False"),
        (lambda i, o: gltf_ext.decompress(i, o, level=True), "level is True; use 0 or more"),
    ],
)
def test_functions_refuse_wrong_options_before_they_read(call, message, tmp_path):
    with pytest.raises(gltf_ext.MeshletError) as caught:
        call(tmp_path / "missing.glb", tmp_path / "out")
    assert str(caught.value).startswith(message)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", [24, {"position_bits": 4}, Options(position_bits=4), None])
def test_options_without_names_are_refused(tmp_path, value):
    with pytest.raises(TypeError, match="takes two files; name each option: position_bits=14"):
        gltf_ext.compress("in.obj", tmp_path / "out.glb", value)


def test_efforts_trade_time_for_size(tmp_path):
    """Every effort gives a file of the same mesh."""
    positions, triangles = grid_mesh(60, 60)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    original = builder.write(tmp_path / "in.glb")
    sizes = {}
    for effort in ("fast", "normal"):
        report = gltf_ext.compress(original, tmp_path / f"{effort}.glb", effort=effort)
        sizes[effort] = report["output_bytes"]
        assert gltf_ext.verify(original, tmp_path / f"{effort}.glb")["ok"]
        assert gltf_ext.validate(tmp_path / f"{effort}.glb") == []
    assert len(set(sizes.values())) > 1


def test_numpy_numbers_are_numbers():
    options = Options(position_bits=np.int64(9), step=None, lambda_=np.float32(2))
    assert options.position_bits == 9 and options.generation["lambda_"] == 2


# --- progress ---


def test_progress_may_be_a_function(tmp_path):
    source, shares = write_grid(tmp_path / "in.glb", 30), []
    gltf_ext.compress(source, tmp_path / "out.glb", progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == pytest.approx(1.0)
    gltf_ext.compress(source, tmp_path / "plain.glb")
    assert (tmp_path / "out.glb").read_bytes() == (tmp_path / "plain.glb").read_bytes()


@pytest.mark.parametrize("options", [{}, {"lod": True}, {"threads": 1}])
def test_progress_cancels_by_an_error(tmp_path, options):
    class Cancelled(Exception):
        pass

    def cancel(share):
        if share > 0.3:
            raise Cancelled

    builder = Builder()
    for _ in range(3):
        builder.mesh({"POSITION": grid_mesh(40, 40)[0]}, grid_mesh(40, 40)[1])
    source = builder.write(tmp_path / "in.glb")
    with pytest.raises(Cancelled):
        gltf_ext.compress(source, tmp_path / "out.glb", progress=cancel, **options)
    assert [path.name for path in tmp_path.iterdir()] == ["in.glb"]


# --- images ---


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
@pytest.mark.parametrize("images", ["embed", "keep"])
def test_images_stay_in_their_files(tmp_path, images, suffix):
    """Those in data: uris have none."""
    png = io.BytesIO()
    Image.new("RGB", (2, 2)).save(png, "PNG")
    (tmp_path / "a b.png").write_bytes(png.getvalue())
    data = "data:image/png;base64," + base64.b64encode(png.getvalue()).decode()
    builder = Builder()
    builder.mesh({"POSITION": grid_mesh(9, 9)[0]}, grid_mesh(9, 9)[1])
    builder.properties["images"] = [{"uri": "a%20b.png"}, {"uri": data}]
    source = builder.write(tmp_path / "in.glb")
    output = tmp_path / f"out{suffix}"
    report = gltf_ext.compress(source, output, images=images)
    assert report["warnings"] == []
    document = read_document(output)
    first, second = (image.get("uri") for image in document.images)
    assert first == ("a%20b.png" if images == "keep" else None) and second is None
    assert gltf_ext.verify(source, output)["ok"]


def test_warnings_of_all_that_a_report_has(tmp_path):
    positions, triangles = grid_mesh(9, 9)
    builder = Builder()
    builder.mesh({"POSITION": positions}, np.vstack([triangles, np.array([[0, 0, 1]], np.uint32)]))
    builder.mesh({"POSITION": positions, "_X": positions[:, :1]}, mode=0)
    report = gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb", lod=True)
    assert gltf_ext.compress_warnings(report) == [
        *report["warnings"],
        "1 primitive with 128 triangles cannot be simplified and have one level",
        "1 degenerate triangles are dropped",
    ]


@pytest.mark.parametrize("triangles", [[], [[0, 0, 1]]])
def test_a_model_without_triangles_has_an_error_of_its_own(tmp_path, triangles):
    builder = Builder()
    indices = {"indices": np.array(triangles, np.uint32)} if len(triangles) else {"mode": 0}
    builder.mesh({"POSITION": grid_mesh(9, 9)[0]}, **indices)
    with pytest.raises(gltf_ext.NothingToCompress, match="there is nothing to compress"):
        gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")
