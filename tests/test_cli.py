"""The command line as users meet it: output, exit statuses, one-line errors, nothing half-written, silence in pipes."""

import errno
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from gltf_builder import Builder, grid_mesh

import gltf_ext
from gltf_ext.cli import main


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
    assert main(["compress", str(original), str(tmp_path / "out.glb"), "-vp", "10", "--threads", "1"]) == 0
    line = capsys.readouterr().out
    assert (
        line.startswith("in.glb (0.0")
        and " -> out.glb (0.0" in line
        and "bits per triangle" in line
        and "on average" in line
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
            "--weight",
            "choe",
            "--iterations",
            "3",
            "--lambda",
            "2",
            "--fill",
            "0.7",
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
    assert "the same: 722 triangles, 0 missing, 0 extra" in capsys.readouterr().out
    assert main(["verify", str(original), str(compressed), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"] is True
    assert main(["decompress", str(compressed), str(tmp_path / "plain.glb")]) == 0
    assert capsys.readouterr().out.endswith("722 triangles\n")
    assert main(["validate", str(compressed)]) == 0
    assert capsys.readouterr().out == f"{compressed}: valid\n"
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
    more = {"compress": ["out.glb"], "decompress": ["out.glb"], "verify": [str(tmp_path / "nothing.glb")]}.get(
        command, []
    )
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
        (["-vp", "25"], "position_bits is 25; use 4 to 24"),
        (["--max-triangles", "65"], "max_triangles is 65"),
        (["--step", "0"], "step is 0.0"),
        (["--step", "nan"], "step is nan"),
        (["--step", "1e300"], "step is 1e+300"),
        (["--step", "1e-60"], "needs more than 24 bits"),
        (["--iterations", "-1"], "iterations is -1"),
        (["--fill", "1.5"], "fill is 1.5; use 0.25 to 1"),
    ],
)
def test_options_out_of_range(original, tmp_path, capsys, arguments, message):
    assert main(["compress", str(original), str(tmp_path / "out.glb"), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize("arguments", [[], ["compress"], ["compress", "a", "b", "-vp", "many"], ["fly"]])
def test_usage_errors_are_one_line(capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2 and len(capsys.readouterr().err.splitlines()) == 1


def test_output_must_be_glb(original, tmp_path, capsys):
    assert main(["compress", str(original), str(tmp_path / "out.gltf")]) == 2
    assert "not a .glb" in error_line(capsys, tmp_path / "out.gltf")


def test_existing_output_survives_an_error(compressed, tmp_path, capsys):
    before = compressed.read_bytes()
    (tmp_path / "bad.glb").write_bytes(b"glTF")
    assert main(["compress", str(tmp_path / "bad.glb"), str(compressed)]) == 2
    assert compressed.read_bytes() == before


def test_a_file_can_be_compressed_onto_itself(original, tmp_path, capsys):
    (tmp_path / "copy.glb").write_bytes(original.read_bytes())
    assert main(["compress", str(original), str(original)]) == 0
    assert main(["verify", str(tmp_path / "copy.glb"), str(original)]) == 0


def test_missing_folder(original, tmp_path, capsys):
    output = tmp_path / "no" / "out.glb"
    assert main(["compress", str(original), str(output)]) == 2
    assert "its folder does not exist" in error_line(capsys, output)


def test_a_full_disk_leaves_nothing(original, tmp_path, capsys, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    assert main(["compress", str(original), str(tmp_path / "out.glb"), "--fallback"]) == 2
    assert "No space left" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["in.glb"]


def run(*arguments, code=None):
    command = (
        [sys.executable, "-m", "gltf_ext.cli", *map(str, arguments)] if code is None else [sys.executable, "-c", code]
    )
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "COLUMNS": "80"})


def test_silence_in_a_pipe(original, tmp_path):
    result = run("compress", original, tmp_path / "out.glb")
    assert result.returncode == 0 and result.stderr == "" and len(result.stdout.splitlines()) == 1


def test_version_and_help():
    assert run("--version").stdout == f"gltf-meshlet {gltf_ext.__version__}\n"
    assert all(
        name in run("--help").stdout for name in ("compress", "decompress", "inspect", "verify", "validate", "demo")
    )


def test_import_is_light():
    result = run(
        code="import sys, gltf_ext; print(*[m for m in ('numpy', 'trimesh', 'pygltflib', 'tqdm') if m in sys.modules])"
    )
    assert result.stdout == "\n", result.stderr


def test_closed_pipe_is_no_traceback(compressed):
    shell = f"{sys.executable} -m gltf_ext.cli inspect {compressed} --json | true"
    assert subprocess.run(shell, shell=True, capture_output=True, text=True).stderr == ""
