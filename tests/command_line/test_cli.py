"""The command line: output, exit statuses, one-line errors, complete files, silence in pipes."""

import errno
import io
import json
import os
import re
import subprocess
import sys
import types
from unittest import mock

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_ext import portable
from gltf_meshlet import cli, render_command
from gltf_meshlet.cli import main
from tests.helpers.gltf_builder import Builder, glb_json, grid_mesh


@pytest.fixture
def original(tmp_path):
    positions, triangles = grid_mesh(20, 20)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    return builder.write(tmp_path / "in.glb")


@pytest.fixture
def compressed(original, tmp_path, capsys):
    assert main(["compress", str(original), str(tmp_path / "out.glb")]) == 0
    capsys.readouterr()
    return tmp_path / "out.glb"


def error_line(capsys, path):
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith(f"gltf-meshlet: {path}: ") and ";" in line
    return line


def test_compress_prints_sizes(original, tmp_path, capsys):
    assert (
        main(["compress", str(original), str(tmp_path / "out.glb"), "-vp", "10", "--threads", "1"])
        == 0
    )
    line = capsys.readouterr().out
    assert re.fullmatch(
        r"in\.glb \([\d.]+ kB\) -> out\.glb \([\d.]+ kB\), [\d.]+ times smaller; "
        r"geometry [\d.]+ times smaller than raw floats, [\d.]+ bits per triangle, "
        r"722 triangles in \d+ meshlets \([\d.]+ on average\)\n"
        r"steps: positions [\d.]+ scene units \(10 bits\)\n",
        line,
    )


def test_options_reach_the_encoder(original, tmp_path, capsys):
    output = str(tmp_path / "out.glb")
    main(
        [
            "compress",
            str(original),
            output,
            "-vp",
            "9",
            "--max-triangles",
            "20",
            "--effort",
            "fast",
            "--lambda",
            "2",
            "--grid",
            "scene",
        ]
    )
    capsys.readouterr()
    main(["inspect", output, "--json"])
    report = json.loads(capsys.readouterr().out)
    assert report["primitives"][0]["attributes"]["POSITION"]["bits_per_component"] == [9]
    assert report["totals"]["mean_triangles_per_meshlet"] <= 20


def test_roundtrip_commands(original, compressed, tmp_path, capsys):
    assert main(["verify", str(original), str(compressed)]) == 0
    assert (
        "the same triangles, within the bits: 722 triangles, 0 missing, 0 extra"
        in capsys.readouterr().out
    )
    assert main(["verify", str(original), str(compressed), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"] is True
    assert main(["decompress", str(compressed), str(tmp_path / "plain.glb")]) == 0
    assert capsys.readouterr().out.endswith("722 triangles\n")
    meshlets = gltf_ext.inspect(compressed)["totals"]["meshlets"]
    assert main(["validate", str(compressed)]) == 0
    assert capsys.readouterr().out == f"{compressed}: well formed: {meshlets} meshlets decoded\n"
    assert main(["inspect", str(compressed)]) == 0
    assert "references and headers" in capsys.readouterr().out


def test_verify_exits_with_one_for_a_difference(compressed, tmp_path, capsys):
    positions, triangles = grid_mesh(20, 20)
    builder = Builder()
    builder.mesh({"POSITION": positions + np.float32([0, 0, 0.01])}, triangles)
    other = builder.write(tmp_path / "other.glb")
    assert main(["verify", str(other), str(compressed)]) == 1
    assert "NOT THE SAME" in capsys.readouterr().out
    assert main(["verify", str(other), str(compressed), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["triangles_equal"] is False


@pytest.mark.parametrize("command", ["compress", "decompress", "inspect", "verify", "validate"])
def test_errors_are_one_line(tmp_path, capsys, command):
    more = {
        "compress": ["out.glb"],
        "decompress": ["out.glb"],
        "verify": [str(tmp_path / "nothing.glb")],
    }.get(command, [])
    missing = tmp_path / "nothing.glb"
    assert main([command, str(missing), *(str(tmp_path / m) for m in more)]) == 2
    assert "No such file" in error_line(capsys, missing)
    damaged = tmp_path / "damaged.glb"
    damaged.write_bytes(b"glTF nonsense")
    assert main([command, str(damaged), *(str(tmp_path / m) for m in more)]) == 2
    error_line(capsys, damaged)
    assert [p.name for p in tmp_path.iterdir()] == ["damaged.glb"]


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["-vp", "25"], "-vp is 25; use 4 to 24"),
        (["--max-triangles", "65"], "--max-triangles is 65"),
        (["--step", "0"], "--step is 0.0"),
        (["--step", "nan"], "--step is nan"),
        (["--step", "1e300"], "--step is 1e+300"),
        (["--step", "1e-60"], "needs more than 24 bits"),
        (["--effort", "high"], "--effort is 'high'; use fast or normal"),
        (["--step", "12"], "leaves fewer than 4 bits"),
        (["--step", "0.001", "-vp", "12"], "--step and -vp"),
    ],
)
def test_options_out_of_range(original, tmp_path, capsys, arguments, message):
    assert main(["compress", str(original), str(tmp_path / "out.glb"), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize(
    "arguments", [[], ["compress"], ["compress", "a", "b", "-vp", "many"], ["fly"]]
)
def test_usage_errors_are_one_line(capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2 and len(capsys.readouterr().err.splitlines()) == 1


def test_output_must_be_gltf(original, tmp_path, capsys):
    assert main(["compress", str(original), str(tmp_path / "out.ply")]) == 2
    assert "not a .glb or .gltf" in error_line(capsys, tmp_path / "out.ply")


def test_existing_output_survives_an_error(compressed, tmp_path, capsys):
    before = compressed.read_bytes()
    (tmp_path / "bad.glb").write_bytes(b"glTF")
    assert main(["compress", str(tmp_path / "bad.glb"), str(compressed)]) == 2
    assert compressed.read_bytes() == before


@pytest.mark.parametrize("link", [None, os.symlink, os.link])
def test_a_file_is_not_written_onto_itself(original, tmp_path, capsys, link):
    output = original if link is None else tmp_path / "link.glb"
    if link:
        link(original, output)
    before = original.read_bytes()
    assert main(["compress", str(original), str(output)]) == 2
    assert "is the input too; name another output" in error_line(capsys, output)
    assert original.read_bytes() == before


def test_the_fallback_does_not_overwrite_the_inputs_buffer(compressed, original, tmp_path, capsys):
    builder = Builder()
    positions, triangles = grid_mesh(4, 4)
    builder.mesh({"POSITION": positions}, triangles)
    builder.write(tmp_path / "in.glb")
    properties = glb_json(tmp_path / "in.glb")
    data = (tmp_path / "in.glb").read_bytes()[-properties["buffers"][0]["byteLength"] :]
    properties["buffers"][0]["uri"] = "new.fallback.bin"
    (tmp_path / "new.fallback.bin").write_bytes(data)
    (tmp_path / "new.gltf").write_text(json.dumps(properties))
    assert (
        main(["compress", str(tmp_path / "new.gltf"), str(tmp_path / "new.glb"), "--fallback"]) == 2
    )
    assert "is the input too" in error_line(capsys, tmp_path / "new.fallback.bin")
    assert (tmp_path / "new.fallback.bin").read_bytes() == data


TRIANGLE_OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"


def textured(folder, library="m.mtl", texture="t.png"):
    """An .obj with its materials and a texture."""
    Image.new("RGB", (2, 2)).save(folder / "pixels.png")
    os.replace(folder / "pixels.png", folder / texture)
    (folder / library).write_text(f"newmtl m\nmap_Kd {texture}\n")
    (folder / "in.obj").write_text(f"mtllib {library}\n{TRIANGLE_OBJ}")
    return folder / "in.obj"


@pytest.mark.parametrize("names", [("out.glb", "t.png"), ("m.mtl", "out.glb")])
@pytest.mark.parametrize("limit", [[], ["--max-memory", "1G"]])
def test_what_an_obj_reads_is_not_overwritten(tmp_path, capsys, names, limit):
    model = textured(tmp_path, *names)
    before = (tmp_path / "out.glb").read_bytes()
    assert main(["compress", str(model), str(tmp_path / "out.glb"), *limit]) == 2
    assert "is the input too" in error_line(capsys, tmp_path / "out.glb")
    assert (tmp_path / "out.glb").read_bytes() == before


def test_a_long_name(original, tmp_path, capsys):
    output = tmp_path / f"{'n' * 251}.glb"
    assert main(["compress", str(original), str(output)]) == 0
    assert gltf_ext.inspect(output)["totals"]["triangles"] == 722
    assert sorted(tmp_path.iterdir()) == sorted([original, output])


def test_names_do_not_control_the_terminal(original, tmp_path, capsys):
    name = str(tmp_path / "\x1b[2J.glb")
    assert main(["inspect", name]) == 2
    assert "\x1b" not in capsys.readouterr().err
    os.link(original, name)
    assert main(["compress", name, str(tmp_path / "\x1b[3J.glb")]) == 0
    assert main(["transcode", str(tmp_path / "\x1b[3J.glb"), str(tmp_path / "p.glb")]) == 0
    assert main(["validate", str(tmp_path / "p.glb")]) == 0
    assert main(["inspect", str(tmp_path / "\x1b[3J.glb")]) == 0
    shown = capsys.readouterr()
    assert "\x1b" not in shown.out + shown.err and "\\x1b[3J.glb" in shown.out


def test_missing_folder(original, tmp_path, capsys):
    output = tmp_path / "no" / "out.glb"
    assert main(["compress", str(original), str(output)]) == 2
    assert "its folder does not exist" in error_line(capsys, output)


def test_a_full_disk_leaves_nothing(original, tmp_path, capsys, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    assert main(["compress", str(original), str(tmp_path / "out.glb"), "--fallback"]) == 2
    line = error_line(capsys, tmp_path / "out.fallback.bin")
    assert "No space left" in line and "free some space" in line
    assert [p.name for p in tmp_path.iterdir()] == ["in.glb"]


def run(*arguments, code=None):
    command = (
        [sys.executable, "-m", "gltf_meshlet.cli", *map(str, arguments)]
        if code is None
        else [sys.executable, "-c", code]
    )
    return subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "COLUMNS": "80"}
    )


def test_silence_in_a_pipe(original, tmp_path):
    result = run("compress", original, tmp_path / "out.glb")
    assert result.returncode == 0 and result.stderr == "" and len(result.stdout.splitlines()) == 2


def test_version_and_help():
    assert run("--version").stdout == f"gltf-meshlet {gltf_ext.__version__}\n"
    assert all(
        name in run("--help").stdout
        for name in ("compress", "decompress", "inspect", "verify", "validate", "render", "demo")
    )


def imported(code: str, *modules: str) -> str:
    """Runs Python code in a new process; the last line of its output names those imported."""
    report = f"print(*[m for m in {modules} if m in sys.modules])"
    lines = ["import sys", "try:", *(f"    {line}" for line in code.split("; "))]
    result = run(code="\n".join([*lines, "finally:", f"    {report}"]))
    assert result.stderr == ""
    return result.stdout.splitlines()[-1]


SLOW_MODULES = ("trimesh", "tqdm", "matplotlib", "DracoPy", "PIL", "meshoptimizer")


def test_import_is_light():
    assert imported("import gltf_ext", "numpy", "pygltflib", *SLOW_MODULES) == ""


def test_the_command_line_starts_without_the_options_of_all_commands():
    slow = ("numpy", "pygltflib", *SLOW_MODULES, "dataclasses", "gltf_meshlet.render_command")
    assert imported("from gltf_meshlet import cli; cli.main(['--version'])", *slow) == ""


@pytest.mark.parametrize("command", ["compress", "decompress", "inspect"])
def test_commands_import_only_what_they_need(command, original, compressed, tmp_path):
    files = {
        "compress": [original, tmp_path / "out.glb"],
        "decompress": [compressed, tmp_path / "plain.glb"],
        "inspect": [compressed],
    }
    arguments = [command, *map(str, files[command])]
    slow = (*SLOW_MODULES, "concurrent.futures", "gltf_scene", "gltf_ext.lod.writing")
    assert imported(f"from gltf_meshlet import cli; cli.main({arguments})", *slow) == ""


def test_compress_imports_nothing_of_levels(original, tmp_path):
    arguments = ["compress", str(original), str(tmp_path / "out.glb")]
    code = f"from gltf_meshlet import cli; cli.main({arguments})"
    assert imported(code, "gltf_ext.lod.reading", "gltf_ext.lod.cuts") == ""


def test_closed_pipe_is_no_traceback(compressed):
    shell = f"{sys.executable} -m gltf_meshlet.cli inspect {compressed} --json | true"
    assert subprocess.run(shell, shell=True, capture_output=True, text=True).stderr == ""


def test_a_coarse_step_warns_of_small_meshes(tmp_path, capsys):
    positions, triangles = grid_mesh(20, 20)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.mesh({"POSITION": positions * np.float32(0.001)}, triangles)
    path = builder.write(tmp_path / "two.glb")
    assert (
        main(["compress", str(path), str(tmp_path / "out.glb"), "--grid", "scene", "-vp", "8"]) == 0
    )
    assert "mesh 1: fewer than 4 bits are left for its positions" in capsys.readouterr().err
    assert main(["verify", str(path), str(tmp_path / "out.glb")]) == 0
    printed = capsys.readouterr()
    assert "722 collapsed by the grid" in printed.out
    assert "mesh 1 primitive 0: the grid collapses 722 triangles, 100 %" in printed.err


def test_python_m():
    result = subprocess.run(
        [sys.executable, "-m", "gltf_meshlet", "--version"], capture_output=True, text=True
    )
    assert result.stdout == f"gltf-meshlet {gltf_ext.__version__}\n"


def test_start_makes_no_threads():
    code = """
import os, sys
os.environ.pop("OPENBLAS_NUM_THREADS", None)
from gltf_meshlet.__main__ import main
sys.argv = ["gltf-meshlet", "inspect", "missing.glb"]
assert main() == 2 and "numpy" in sys.modules
print(len(os.listdir("/proc/self/task")))
"""
    assert run(code=code).stdout == "1\n"


def test_an_early_interruption_is_silent():
    code = """
import sys
class Interrupt:
    def find_spec(self, name, path, target=None):
        if name == "gltf_meshlet.cli":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupt())
from gltf_meshlet.__main__ import main
sys.exit(main())
"""
    result = run(code=code)
    assert (result.returncode, result.stderr) == (130, "")


@pytest.mark.parametrize("name", ["äö.glb", os.fsdecode(b"\xff.glb")])
def test_odd_file_names(original, tmp_path, name):
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    for arguments in (
        ["compress", original, tmp_path / name, "--fallback"],
        ["inspect", tmp_path / name],
        ["validate", tmp_path / name],
        ["inspect", tmp_path / ("no" + name)],
    ):
        command = [sys.executable, "-m", "gltf_meshlet", *map(str, arguments)]
        result = subprocess.run(command, capture_output=True, text=True, env=environment)
        assert "Traceback" not in result.stderr and result.returncode == (
            2 if "no" + name in command[-1] else 0
        )


def test_output_is_a_folder(original, tmp_path, capsys):
    (tmp_path / "out.glb").mkdir()
    assert main(["compress", str(original), str(tmp_path / "out.glb")]) == 2
    assert "is a folder; name a file" in error_line(capsys, tmp_path / "out.glb")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_full_standard_output(compressed):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "gltf_meshlet", "inspect", str(compressed)]
        result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert result.returncode == 2
    assert (
        result.stderr == "gltf-meshlet: standard output: No space left on device; free some space\n"
    )


def test_the_fallback_is_named_and_a_stale_one_too(original, tmp_path, capsys):
    output = str(tmp_path / "out.glb")
    assert main(["compress", str(original), output, "--fallback"]) == 0
    assert re.search(
        r"out\.glb \([\d.]+ kB\) \+ out\.fallback\.bin \([\d.]+ kB\)", capsys.readouterr().out
    )
    assert main(["inspect", output]) == 0
    assert re.search(r"fallback +[\d,]+ bytes in out\.fallback\.bin", capsys.readouterr().out)
    assert main(["compress", str(original), output]) == 0
    assert "out.fallback.bin is not part of this result" in capsys.readouterr().err
    assert (tmp_path / "out.fallback.bin").exists()


def test_a_file_that_grew_is_told(tmp_path, capsys):
    builder = Builder()
    builder.mesh(
        {"POSITION": np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]])}, np.uint32([[0, 1, 2]])
    )
    assert (
        main(["compress", str(builder.write(tmp_path / "one.glb")), str(tmp_path / "out.glb")]) == 0
    )
    captured = capsys.readouterr()
    assert (
        "the file grew" in captured.err
        and "1 triangle in 1 meshlet" in captured.out
        and " B)" in captured.out
    )


def test_a_missing_fallback_is_told_once(original, tmp_path, capsys):
    output = tmp_path / "out.glb"
    main(["compress", str(original), str(output), "--fallback"])
    (tmp_path / "out.fallback.bin").unlink()
    capsys.readouterr()
    assert main(["validate", str(output)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "out.fallback.bin" in line and "the compressed data is intact" in line


def test_verify_tells_which_argument_is_wrong(original, compressed, tmp_path, capsys):
    assert main(["verify", str(compressed), str(original)]) == 2
    assert "the arguments are swapped" in error_line(capsys, original)
    main(["decompress", str(compressed), str(tmp_path / "plain.glb")])
    capsys.readouterr()
    assert main(["verify", str(original), str(tmp_path / "plain.glb")]) == 2
    assert "gltf-meshlet verify ORIGINAL COMPRESSED" in error_line(capsys, tmp_path / "plain.glb")


def test_usage_errors_of_a_command_point_at_its_help(capsys):
    with pytest.raises(SystemExit):
        main(["compress", "a", "b", "--no"])
    assert "see gltf-meshlet compress --help" in capsys.readouterr().err


def test_an_empty_file(tmp_path, capsys):
    (tmp_path / "a.glb").touch()
    assert main(["compress", str(tmp_path / "a.glb"), str(tmp_path / "out.glb")]) == 2
    assert "is empty; export it again" in error_line(capsys, tmp_path / "a.glb")


def test_python_errors_name_the_file_and_the_option(tmp_path):
    (tmp_path / "a.glb").write_bytes(b"glTF nonsense")
    with pytest.raises(gltf_ext.MeshletError, match=r"a\.glb: "):
        gltf_ext.load(tmp_path / "a.glb")
    with pytest.raises(gltf_ext.MeshletError, match="position_bits is '12'; use 4 to 24"):
        gltf_ext.compress("a.glb", "b.glb", position_bits="12")
    with pytest.raises(gltf_ext.MeshletError, match="step is 'x'"):
        gltf_ext.compress("a.glb", "b.glb", step="x")
    with pytest.raises(gltf_ext.MeshletError, match="vp is not an option"):
        gltf_ext.compress("a.glb", "b.glb", vp=12)


# --- render, without a back end ---


@pytest.fixture
def rendered(monkeypatch):
    """A list of the (options, inspected input) that a fake back end gets."""
    asked = []
    fake = types.SimpleNamespace(
        main=lambda options: asked.append((options, gltf_ext.inspect(options.input))) or 0
    )
    monkeypatch.setattr(render_command, "_backend", lambda backend: fake)
    return asked


def test_render_passes_its_options_on(compressed, tmp_path, rendered):
    picture = str(tmp_path / "out.png")
    assert main(["render", str(compressed), "-o", picture, "--spp", "7"]) == 0
    assert (
        main(
            [
                "render",
                str(compressed),
                "-o",
                picture,
                "--backend",
                "vulkan",
                "--path",
                "rt",
                "--frames",
                "3",
                "--validate",
                "--cache",
                "50%",
            ]
        )
        == 0
    )
    assert (
        main(["render", str(compressed), "-o", picture, "--backend", "vulkan", "--cache", "9M"])
        == 0
    )
    (first, _), (second, _), (third, _) = rendered
    assert (first.input, first.output, first.spp, first.variant, first.cache) == (
        str(compressed),
        picture,
        7,
        "scalar_rgb",
        None,
    )
    assert first.accel == "auto"
    assert (
        second.cache,
        second.path,
        second.frames,
        second.bounces,
        second.validate,
        second.device,
        second.pages,
    ) == (0.5, "rt", 3, 0, True, None, None)
    assert (third.path, third.cache) == (None, 9 << 20)


@pytest.mark.parametrize("link", [None, os.symlink, os.link])
def test_render_does_not_overwrite_what_the_scene_reads(original, tmp_path, rendered, capsys, link):
    picture = tmp_path / ("link.png" if link else "t.png")
    model = textured(tmp_path)
    if link:
        link(tmp_path / "t.png", picture)
    before = picture.read_bytes()
    assert main(["render", str(model), "-o", str(picture)]) == 2
    assert "is the input too" in error_line(capsys, picture)
    assert rendered == [] and picture.read_bytes() == before
    assert main(["render", str(model), "-o", str(tmp_path / "out.png")]) == 0
    ((options, _),) = rendered
    assert set(options.read) == {str(model), tmp_path / "m.mtl", tmp_path / "t.png"}


def test_render_compresses_what_is_not(original, tmp_path, rendered, capsys):
    assert main(["render", str(original), "-o", str(tmp_path / "out.png")]) == 0
    ((options, report),) = rendered
    assert report["totals"]["triangles"] == 722 and not os.path.exists(options.input)
    assert f"{original}: is not compressed; rendering a copy" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--width", "0"], "--width is 0; use 1 to 16384"),
        (["--spp", "0"], "--spp is 0; use 1 or more"),
        (["--lod-error", "nan"], "--lod-error is nan; use 0 or more"),
        (["--lod-error", "-1"], "--lod-error is -1.0; use 0 or more"),
        (
            ["--backend", "vulkan", "--path", "stream", "--lod-error", "1"],
            "--lod-error is for --path visibility or mesh or mesh-paper or rt; leave",
        ),
        (
            ["--backend", "vulkan", "--path", "mesh-paper", "--pages", "9M"],
            "--pages is for levels of detail; leave it out or add --lod-error",
        ),
        (
            ["--backend", "vulkan", "--path", "rt", "--pages", "9M", "--lod-error", "1"],
            "--pages is for --path visibility or mesh or mesh-paper; leave",
        ),
        (["--lod-error", "inf"], "--lod-error is inf; use 0 or more"),
        (["--path", "rt"], "--path is for --backend vulkan"),
        (["--backend", "vulkan", "--spp", "4"], "--spp is for --backend mitsuba"),
        (["--backend", "vulkan", "--frames", "0"], "--frames is 0; use 1 or more"),
        (
            ["--backend", "vulkan", "--path", "vertex", "--cache", "9"],
            "--cache is for --path visibility or stream or rt; leave it out or change --path",
        ),
        (
            ["--backend", "vulkan", "--path", "mesh", "--bounces", "0"],
            "--bounces is for --path rt; leave",
        ),
        (
            ["--backend", "vulkan", "--path", "tape"],
            "there is no path tape; there are visibility, ",
        ),
        (["-o", "nowhere/out.png"], "nowhere/out.png: its folder does not exist; create it first"),
    ],
)
def test_render_options_out_of_range(compressed, tmp_path, rendered, capsys, arguments, message):
    assert main(["render", str(compressed), "-o", str(tmp_path / "out.png"), *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line and rendered == []


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ("9X", "'9X' is no number such as 2G or 800M"),
        ("0.5", "'0.5' is no number such as 2G or 800M"),
        ("-1", "'-1' is no number"),
        ("200%", "'200%' is no share from 0% to 100%"),
        ("nan%", "'nan%' is no share from 0% to 100%"),
        ("much%", "'much%' is no share from 0% to 100%"),
    ],
)
def test_render_cache_of_no_size(compressed, capsys, size, message):
    with pytest.raises(SystemExit) as stopped:
        main(["render", str(compressed), "-o", "out.png", f"--cache={size}"])
    assert stopped.value.code == 2
    assert f"argument --cache: {message}" in capsys.readouterr().err


@pytest.mark.parametrize("backend, package", [("mitsuba", "mitsuba"), ("vulkan", "vulkan")])
def test_render_without_the_extra(compressed, tmp_path, capsys, backend, package):
    arguments = ["render", str(compressed), "-o", str(tmp_path / "out.png"), "--backend", backend]
    with mock.patch.dict(sys.modules):  # also forgets what is imported meanwhile
        for name in list(sys.modules):
            if name.partition(".")[0] in (package, "mitsuba_plugin", "vk_backend"):
                del sys.modules[name]
        sys.modules[package] = None  # importing it fails
        assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"pip install 'gltf-meshlet[{backend}]'" in line


# --- Windows ---


@pytest.mark.parametrize(
    "error, remedy",
    [
        (PermissionError(errno.EACCES, "in use", "out.glb"), "close other programs that use it"),
        (FileNotFoundError(errno.ENOENT, "no", "x" * 240), "enable long paths in Windows"),
        (FileNotFoundError(errno.ENOENT, "no", "x.glb"), "check the path"),
    ],
)
def test_remedies_on_windows(monkeypatch, capsys, error, remedy):
    for module in (cli, portable):
        monkeypatch.setattr(module, "IS_WINDOWS", True)
    assert cli._fail_for(error) == cli.FAILED
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(remedy) or f"{remedy}, or" in line


# The second is what Windows says of a closed pipe, and of much else.
CLOSED_PIPE = [(errno.EPIPE, "Broken pipe"), (errno.EINVAL, "Invalid argument")]


def failing(error):
    """A function that raises it."""

    def fail(*_, **__):
        raise OSError(*error)

    return fail


@pytest.mark.parametrize("function", ["write", "flush"])
@pytest.mark.parametrize("error", CLOSED_PIPE)
def test_a_closed_pipe_on_windows(monkeypatch, capsys, compressed, function, error):
    output = io.StringIO()
    setattr(output, function, failing(error))
    monkeypatch.setattr(cli, "IS_WINDOWS", True)
    monkeypatch.setattr(cli, "_discard_output", lambda: None)
    monkeypatch.setattr(sys, "stdout", output)
    assert main(["validate", str(compressed)]) == cli.FAILED
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("error", CLOSED_PIPE)
@pytest.mark.parametrize("is_windows", [True, False])
def test_errors_of_no_file_are_not_those_of_a_closed_pipe(monkeypatch, capsys, error, is_windows):
    monkeypatch.setattr(cli, "IS_WINDOWS", is_windows)
    monkeypatch.setattr(gltf_ext, "validate", failing(error))
    assert main(["validate", "in.glb"]) == cli.FAILED
    assert capsys.readouterr().err == f"gltf-meshlet: in.glb: {error[1]}; run again\n"
