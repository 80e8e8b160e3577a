#!/usr/bin/env python3
"""Installs a wheel in an empty environment and runs README.md's commands there, word for word.

python tools/try_wheel.py FOLDER TAG [--without WORD ..]: FOLDER has the wheel for platform TAG;
commands with a WORD are left out. Needs only Python. pip takes the wheel from FOLDER instead of an
index, everything else as usual. The models that README names are generated.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SECONDS = 1200  # of a command; Vulkan on a CPU compiles shaders for minutes
WINDOWS = sys.platform == "win32"
# The first models of the README, then those of its other lines.
MODELS = """
from pathlib import Path
from gltf_meshlet.demo import model
all = model.generate()
Path("models").mkdir()
for name, part in (("bunny", all), ("scan", all[:2]), ("models/gear", all[2:3])):
    model.write_glb(part, Path(f"{name}.glb"))
"""


def main(arguments: list[str] | None = None) -> int:
    """Returns the exit status: 1 if a command failed."""
    parser = argparse.ArgumentParser(description="Run README.md's commands with a wheel.")
    parser.add_argument("folder", type=Path, help="has the wheel")
    parser.add_argument("tag", help="the wheel's platform, such as win_amd64")
    parser.add_argument("--without", nargs="+", default=[], metavar="WORD", help="leave out")
    options = parser.parse_args(arguments)
    wheels = list(options.folder.glob(f"gltf_meshlet-*-py3-none-{options.tag}.whl"))
    if len(wheels) != 1:
        print(f"{options.folder} has {len(wheels)} wheels for {options.tag}", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=WINDOWS) as temporary:
        return try_wheel(wheels[0].resolve(), Path(temporary), options.without)


def try_wheel(wheel: Path, folder: Path, without: list[str]) -> int:
    """Returns the exit status."""
    environment = make_environment(wheel, folder)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    install, *others = commands(readme)
    generate = ["python", "-c", MODELS]
    for command in (install, generate, *others, ["python", "-c", python_block(readme)]):
        shown = "python" if command[0] == "python" else shlex.join(command)
        if set(command) & set(without):
            print(f"left out: {shown}", flush=True)
            continue
        start = time.monotonic()
        status, output = run(command, folder, environment)
        print(f"{time.monotonic() - start:6.1f} s: {shown}", flush=True)
        if status:
            print(f"{output}\nexit status {status}: {shown}", file=sys.stderr)
            return 1
    return 0


def make_environment(wheel: Path, folder: Path) -> dict[str, str]:
    """An empty virtual environment in a folder, and the variables with which it takes the wheel."""
    subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
    constraints = folder / "constraints.txt"
    constraints.write_text(f"gltf-meshlet=={wheel.name.split('-')[1]}\n", encoding="utf-8")
    programs = folder / "venv" / ("Scripts" if WINDOWS else "bin")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment["PATH"] = os.pathsep.join([str(programs), environment.get("PATH", os.defpath)])
    environment.update(
        BROWSER="true",  # `view` opens none
        PIP_CONSTRAINT=str(constraints),
        PIP_DISABLE_PIP_VERSION_CHECK="1",
        PIP_FIND_LINKS=str(wheel.parent),
        PYTHONUTF8="1",
    )
    return environment


def commands(readme: str) -> list[list[str]]:
    """The command lines under "Command line", as their words."""
    block = re.search(r"^## Command line\n+```\n(.*?)```", readme, re.M | re.S)
    if block is None:
        raise ValueError("README.md has no commands")
    lines = (shlex.split(line, comments=True) for line in block[1].splitlines())
    return [words for words in lines if words]


def python_block(readme: str) -> str:
    """The code under "Python"."""
    block = re.search(r"^## Python\n+```python\n(.*?)```", readme, re.M | re.S)
    if block is None:
        raise ValueError("README.md has no Python")
    return block[1]


def run(command: list[str], folder: Path, environment: dict[str, str]) -> tuple[int, str]:
    """The exit status and the output of a command."""
    program = shutil.which(command[0], path=environment["PATH"])
    if program is None:
        return 127, f"there is no program {command[0]}"
    process = subprocess.Popen(
        [program, *command[1:]],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    )
    with process:
        try:
            if command[1:2] == ["view"]:
                return _stop_server(process)
            output, _ = process.communicate(timeout=SECONDS)
        except BaseException:
            process.kill()
            raise
    return process.returncode, output


def _stop_server(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Ends `view`, which runs until Ctrl-C, once it says its address."""
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        lines.append(line)
        if "http://" in line:
            if WINDOWS:  # which sends Ctrl-C to whole consoles only
                process.terminate()
                process.wait(timeout=SECONDS)
                return 0, "".join(lines)
            process.send_signal(signal.SIGINT)
            break
    lines.append(process.stdout.read())
    return process.wait(timeout=SECONDS), "".join(lines)


if __name__ == "__main__":
    sys.exit(main())
