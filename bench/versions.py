"""Is decoding as fast as before? Whole models on one thread, beside an earlier commit.

Builds the commit, by default the last one of the format's draft, in build/versions, with the same
compiler and options and with this version's bench/native/decode_speed.cpp. Each version decodes
what its own encoder writes at the default 12/8/12 bits. The two programs take turns.
"""

from __future__ import annotations

import argparse
import io
import os
import shutil
import statistics
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
from pathlib import Path

from bench import peers
from bench.common import ROOT, Question, markdown_table, progress, spread
from bench.models import real_model
from bench.speed import Stopwatch, encode_ours
from tools import native_build

DRAFT = "6928641"
MODELS = ("suzanne", "bunny", "materialball", "sponza_like", "dragon", "igea")
TURN_SECONDS = 0.03  # of one turn: many times the resolution of the clock

# Runs in the other version, whose own modules it imports.
_ENCODE = """
import sys
from pathlib import Path
from bench import peers, speed
blobs = speed.encode_ours(peers.read_primitives(Path(sys.argv[1])), 0, speed.Stopwatch())
for number, blob in enumerate(blobs):
    (Path(sys.argv[2]) / f"{number:03}.blob").write_bytes(blob)
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--commit", default=DRAFT, help="of this repository (default: %(default)s, the draft)"
    )
    parser.add_argument("--models", nargs="*", default=MODELS, metavar="NAME")
    parser.add_argument("--rounds", type=int, default=21, help="turns of each (default: 21)")


def is_complete(options: argparse.Namespace) -> bool:
    return options.commit == DRAFT and tuple(options.models) == MODELS


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    other = checked_out(options.commit)
    programs = [native_build.build("MESHLET_BENCH", other, python=True)]
    for module in programs[0].glob("_codec*"):
        shutil.copy(module, other / "gltf_ext")
    programs.append(native_build.build("MESHLET_BENCH"))
    rows = []
    for name in options.models:
        with tempfile.TemporaryDirectory() as folder:
            blobs = [
                encode_other(other, real_model(name), Path(folder) / "before"),
                encode_own(real_model(name), Path(folder) / "now"),
            ]
            rows.append({"model": name, **compare(programs, blobs, options.rounds)})
        progress(name)
    return {"before": options.commit, "rounds": options.rounds, "models": rows}


def checked_out(commit: str) -> Path:
    """The files of a commit in build/versions, with our program that takes turns."""
    folder = ROOT / "build" / "versions" / commit
    done = subprocess.run(["git", "-C", ROOT, "archive", commit], capture_output=True)
    if done.returncode:
        raise SystemExit(f"bench versions: {done.stderr.decode().strip().splitlines()[0]}")
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(folder, filter="data")
    program = Path("bench", "native", "decode_speed.cpp")
    shutil.copy(ROOT / program, folder / program)
    return folder


def encode_other(version: Path, model: Path, folder: Path) -> list[Path]:
    """The blobs that another version writes. -S: without our package, which is installed."""
    folder.mkdir()
    path = os.pathsep.join([str(version), *{sysconfig.get_path(k) for k in ("purelib", "platlib")}])
    subprocess.run(
        [sys.executable, "-S", "-c", _ENCODE, model, folder],
        check=True,
        cwd=version,
        env={**os.environ, "PYTHONPATH": path},
    )
    return sorted(folder.iterdir())


def encode_own(model: Path, folder: Path) -> list[Path]:
    folder.mkdir()
    blobs = encode_ours(peers.read_primitives(model), 0, Stopwatch())
    for number, blob in enumerate(blobs):
        (folder / f"{number:03}.blob").write_bytes(blob)
    return sorted(folder.iterdir())


def take_turn(program: subprocess.Popen, count: int) -> float:
    """Processor seconds of one decoding, from `count` of them."""
    assert program.stdin is not None and program.stdout is not None
    program.stdin.write(f"{count}\n")
    program.stdin.flush()
    return float(program.stdout.readline()) / count


def compare(programs: list[Path], blobs: list[list[Path]], rounds: int) -> dict:
    """Processor seconds of both versions, and the ratios of turns that follow one another."""
    running = [
        subprocess.Popen(
            [folder / "decode_speed", "--turns", *files],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for folder, files in zip(programs, blobs)
    ]
    seconds: list[list[float]] = [[], []]
    try:
        for program in running:
            take_turn(program, 2)  # warms up
        count = max(1, round(TURN_SECONDS / max(take_turn(running[0], 2), 1e-6)))
        for i in range(rounds):
            for side in (0, 1) if i % 2 == 0 else (1, 0):
                seconds[side].append(take_turn(running[side], count))
    finally:
        for program in running:
            program.communicate()
    ratios = [now / before for before, now in zip(*seconds)]
    return {
        "bytes": [sum(file.stat().st_size for file in files) for files in blobs],
        "before_seconds": spread(seconds[0]),
        "now_seconds": spread(seconds[1]),
        "ratio": {**spread(ratios), "quartiles": statistics.quantiles(ratios, n=4)},
    }


def summary(result: dict) -> str:
    """Milliseconds: median, and the lowest and highest turn; the median ratio of two turns."""
    rows = []
    for row in result["models"]:
        times = [
            f"{1e3 * t['median']:.2f} ({1e3 * t['low']:.2f} to {1e3 * t['high']:.2f})"
            for t in (row["before_seconds"], row["now_seconds"])
        ]
        low, _, high = row["ratio"]["quartiles"]
        lowest = row["now_seconds"]["low"] / row["before_seconds"]["low"]
        ratio = f"{row['ratio']['median']:.3f} ({low:.3f} to {high:.3f})"
        rows.append([row["model"], *times, ratio, f"{lowest:.3f}"])
    headings = [
        "milliseconds",
        f"commit {result['before']}",
        "now",
        "now / before, quartiles",
        "of the lowest",
    ]
    return markdown_table(headings, rows)


def write_pages(result: dict) -> list[Path]:
    return []


def main() -> None:
    Question(
        name="versions",
        about=__doc__ or "",
        measure=measure,
        summary=summary,
        write_pages=write_pages,
        add_options=add_options,
        complete=is_complete,
    ).run()


if __name__ == "__main__":
    main()
