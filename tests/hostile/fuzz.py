"""Mutated glTF files through every command: python -m tests.hostile.fuzz [N] [--seed S] [--only I].

The commands take turns: each mutant goes through `--each` of them, so that all get equally many.
Passing means: exit status 0 or 2 (1 when verify finds a difference), one line for an error,
warnings as every command has them, no exception, no output after an error and a whole one
otherwise, in time, and in bounded memory. Commands run in this process, and one in APART in a
process of its own. Half of the time went to what tells nothing about a file, and is cheaper here:
parsers of arguments and Vulkan devices are made once, and verify samples fewer points.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import functools
import http.client
import importlib
import io
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from unittest import mock

from gltf_ext.checks import verify
from gltf_ext.errors import MeshletError
from gltf_meshlet import cli
from gltf_meshlet.view_models import File, Model
from gltf_meshlet.view_server import ViewServer
from tests.helpers.gltf_builder import glb_bytes
from tests.hostile.mutations import mutated
from tests.hostile.seeds import Seed, make_seeds

MUTANTS = 100_000
TOO_LONG = 5.0  # seconds of one command; it is repeated, since shaders compile the first time
HANGS = 300  # seconds after which all ends: a shader may compile for a minute, nothing longer
# Memory that one command may take beyond what the process has: bytes, and times the file's size.
MEMORY, MEMORY_PER_BYTE = 64 << 20, 40
NOTICES = (": warning: ", "gltf-meshlet: warning: ", ": is not compressed; rendering a copy")
LONGEST_LINE = 1000
PICTURE = ["--width", "16", "--height", "16"]
APART = 2000
SAMPLES = 500  # of a surface, by verify; 50,000 take half a second for each level
STATUSES = {"verify": (0, 1, 2), "verify-reversed": (0, 1, 2)}


class Failure(AssertionError):
    """A command did what it must not."""


@dataclass(frozen=True)
class Mutant:
    """A mutated file on disk.

    size: bytes of all its files; only_positions: it has positions only.
    """

    path: Path
    original: Path
    size: int
    only_positions: bool
    random: Random


Arguments = Callable[[Mutant, Path], list[str]]  # (mutant, new folder for the output) -> arguments


def _decompress(mutant: Mutant, folder: Path) -> list[str]:
    detail = mutant.random.choice([[], ["--level", "1"], ["--error", "1%"]])
    return ["decompress", str(mutant.path), str(folder / "out.glb"), *detail]


def _chunks(mutant: Mutant, folder: Path) -> list[str]:
    more = mutant.random.choice([[], ["--lod"]])
    return ["compress", "--max-memory", "2G", *more, str(mutant.path), str(folder / "out.glb")]


def _mitsuba(mutant: Mutant, folder: Path) -> list[str]:
    more = mutant.random.choice([[], [], ["--lod-error", "2"], ["--camera", "1"]])
    output = str(folder / "out.png")
    return ["render", str(mutant.path), "-o", output, *PICTURE, "--spp", "1", *more]


def _vulkan(mutant: Mutant, folder: Path) -> list[str]:
    # Every set of attributes has shaders of its own, which take 20 seconds to compile on a CPU.
    path = mutant.random.choice(["visibility", "vertex"]) if mutant.only_positions else "vertex"
    more = mutant.random.choice([[], [], ["--camera", "1"]])
    output = str(folder / "out.png")
    backend = ["--backend", "vulkan", "--path", path]
    return ["render", str(mutant.path), "-o", output, *PICTURE, *backend, *more]


COMMANDS: dict[str, Arguments] = {
    "compress": lambda m, f: ["compress", str(m.path), str(f / "out.glb")],
    "compress-lod": lambda m, f: ["compress", "--lod", str(m.path), str(f / "out.glb")],
    "compress-chunks": _chunks,
    "decompress": _decompress,
    "transcode": lambda m, f: ["transcode", str(m.path), str(f / "out.glb")],
    "inspect": lambda m, f: ["inspect", str(m.path), *m.random.choice([[], ["--json"]])],
    "verify": lambda m, f: ["verify", str(m.original), str(m.path)],
    "verify-reversed": lambda m, f: ["verify", str(m.path), str(m.original)],
    "validate": lambda m, f: ["validate", str(m.path)],
    "mitsuba": _mitsuba,
    "vulkan": _vulkan,
    "view-export": lambda m, f: ["view", str(m.path), "--export", str(f / "page")],
}
SERVER = "view-server"
PACKAGES = {
    "mitsuba": "mitsuba_plugin",
    "compress-lod": "meshoptimizer",
    "compress-chunks": "meshoptimizer",
}
ALL = (*COMMANDS, SERVER)


@dataclass
class Counts:
    """Runs by command and outcome; the slowest and the largest run of each command."""

    outcomes: dict[str, Counter[str]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    bytes: dict[str, int] = field(default_factory=dict)

    def add(self, command: str, outcome: str, seconds: float, grown: int) -> None:
        self.outcomes.setdefault(command, Counter())[outcome] += 1
        self.seconds[command] = max(self.seconds.get(command, 0.0), seconds)
        self.bytes[command] = max(self.bytes.get(command, 0), grown)

    def table(self) -> str:
        rows = [
            f"{'command':16} {'runs':>7} {'done':>7} {'refused':>7} {'slowest':>9} {'memory':>9}"
        ]
        for command, outcomes in self.outcomes.items():
            rows.append(
                f"{command:16} {outcomes.total():7} {outcomes['done']:7} {outcomes['refused']:7} "
                f"{self.seconds[command]:7.2f} s {self.bytes[command] / 2**20:6.1f} MB"
            )
        return "\n".join(rows)


class Fuzzer:
    """Makes mutants and runs commands on them. Use it in a `with` block.

    commands: names out of ALL, without those that are `missing`. each: how many of them
    a mutant goes through.
    """

    def __init__(self, seed: int, commands: tuple[str, ...], each: int) -> None:
        self.seed, self.commands, self.counts = seed, commands, Counts()
        self.each = min(each, len(commands))

    def __enter__(self) -> Fuzzer:
        with contextlib.ExitStack() as stack:
            self._open(stack)
            self._stack = stack.pop_all()
        return self

    def _open(self, stack: contextlib.ExitStack) -> None:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hostile-")))
        self.inputs, self._outputs = folder / "in", folder / "out"
        originals = folder / "originals"
        for path in (self.inputs, self._outputs, originals):
            path.mkdir()
        warnings.simplefilter("always")
        faulthandler.register(signal.SIGALRM, chain=True)  # prints where all threads are, then ends
        once = functools.cache(cli._parser)
        fewer = functools.partial(verify.measure_levels, most_samples=SAMPLES)
        stack.enter_context(mock.patch.object(cli, "_parser", once))
        stack.enter_context(mock.patch.object(verify, "measure_levels", fewer))
        self.seeds = make_seeds(originals)
        if SERVER in self.commands:
            self._server = stack.enter_context(_serving(originals))
        if "vulkan" in self.commands:
            stack.enter_context(_one_renderer())
        # The first use of a command imports modules and compiles shaders.
        for seed in self.seeds:
            mutant = self._write("seed", seed, seed.text, seed.binary, Random(0))
            for command in self.commands:
                self._run(command, mutant)
        self.counts = Counts()

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def run(self, number: int) -> None:
        """Makes mutant `number` and runs its commands on it. Raises Failure."""
        random = Random(f"{self.seed}/{number}")
        seed = random.choice(self.seeds)
        text, binary = mutated(seed.text, seed.binary, random)
        mutant = self._write(f"mutant-{number}", seed, text, binary, random)
        for turn in range(number * self.each, (number + 1) * self.each):
            command = self.commands[turn % len(self.commands)]
            try:
                if self._run(command, mutant) and (excess := self._run(command, mutant)):
                    raise Failure(excess)
                if turn % APART == 0 and command != SERVER:
                    self._run_apart(command, mutant)
            except BaseException as error:
                kept = Path(tempfile.mkdtemp(prefix="hostile-mutant-"))
                shutil.copytree(self.inputs, kept, dirs_exist_ok=True)
                print(
                    f"mutant {number} of seed {self.seed}, made of {seed.name}, command {command}: "
                    f"{type(error).__name__}: {error}\nthe file: {kept / mutant.path.name}\nagain: "
                    f"python -m tests.hostile.fuzz --seed {self.seed} --only {number} "
                    f"--commands {command}",
                    file=sys.stderr,
                    flush=True,
                )
                raise

    def _write(self, name: str, seed: Seed, text: str, binary: bytes, random: Random) -> Mutant:
        shutil.rmtree(self.inputs)
        self.inputs.mkdir()
        path = self.inputs / f"{name}{Path(seed.name).suffix}"
        encoded = text.encode("utf-8", "surrogatepass")
        path.write_bytes(encoded if path.suffix == ".gltf" else _glb(encoded, binary))
        for other, data in seed.files.items():
            (self.inputs / other).write_bytes(data)
        size = path.stat().st_size + sum(map(len, seed.files.values()))
        only_positions = seed.name.startswith(("instanced", "lod_"))
        return Mutant(path, seed.original, size, only_positions, random)

    # --- one command ---

    def _run(self, command: str, mutant: Mutant) -> str:
        """Runs it and counts it. Returns its time or memory if that is too much."""
        shutil.rmtree(self._outputs)
        self._outputs.mkdir()
        before, start, used = _reset_peak(), time.perf_counter(), time.process_time()
        signal.alarm(HANGS)
        refused = self._upload(mutant) if command == SERVER else self._call(command, mutant)
        signal.alarm(0)
        grown = _peak() - before
        # Other processes lengthen the time, and threads the processor's.
        seconds = min(time.perf_counter() - start, time.process_time() - used)
        if seconds > TOO_LONG:
            return f"{seconds:.1f} seconds"
        if grown > MEMORY + MEMORY_PER_BYTE * mutant.size:
            return f"{grown / 2**20:.0f} MB for a file of {mutant.size} bytes"
        self.counts.add(command, "refused" if refused else "done", seconds, grown)
        return ""

    def _call(self, command: str, mutant: Mutant) -> bool:
        arguments = COMMANDS[command](mutant, self._outputs)
        output, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            status = cli.main(arguments)
        self._check(command, status, errors.getvalue())
        return status == cli.FAILED

    def _run_apart(self, command: str, mutant: Mutant) -> None:
        shutil.rmtree(self._outputs)
        self._outputs.mkdir()
        line = [sys.executable, "-m", "gltf_meshlet", *COMMANDS[command](mutant, self._outputs)]
        done = subprocess.run(line, capture_output=True, text=True, timeout=HANGS)
        self._check(command, done.returncode, done.stderr)

    def _check(self, command: str, status: int, errors: str) -> None:
        """Raises Failure for a wrong status, lines that are no messages, or half an output."""
        if status not in STATUSES.get(command, (0, 2)):
            raise Failure(f"exit status {status}: {errors}")
        lines = errors.splitlines()
        problems = [line for line in lines if not any(notice in line for notice in NOTICES)]
        if any(not line.startswith("gltf-meshlet: ") or len(line) > LONGEST_LINE for line in lines):
            raise Failure(f"stderr: {errors[:3000]}")
        several = command == "validate" and len(problems) > 1
        if len(problems) != (status == cli.FAILED) and not (several and status == cli.FAILED):
            raise Failure(f"{len(problems)} lines for exit status {status}: {errors}")
        written = [path.name for path in self._outputs.iterdir()]
        expected = [] if status or not _writes(command) else [_writes(command)]
        if written != expected:
            raise Failure(f"it wrote {written}, exit status {status}")
        if status == 0 and command.startswith("compress"):
            self._check_compressed()

    def _check_compressed(self) -> None:
        output, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            cli.main(["inspect", str(self._outputs / "out.glb")])
        if errors.getvalue():
            raise Failure(f"compress wrote a file that inspect refuses: {errors.getvalue()}")

    def _upload(self, mutant: Mutant) -> bool:
        server = self._server
        connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=HANGS)
        errors = io.StringIO()
        with contextlib.redirect_stderr(errors), contextlib.closing(connection):
            target = f"/{server.token}/compress?name={mutant.path.name}"
            connection.request("POST", target, mutant.path.read_bytes())
            answer = connection.getresponse()
            body = json.loads(answer.read())
        if errors.getvalue():
            raise Failure(f"stderr: {errors.getvalue()}")
        if answer.status not in (200, 422):
            raise Failure(f"status {answer.status}: {body}")
        if answer.status == 422 and len(body["error"].splitlines()) != 1:
            raise Failure(f"the problem has several lines: {body}")
        return answer.status != 200


def _writes(command: str) -> str:
    """The name of what a command writes; "" for nothing."""
    if command in ("mitsuba", "vulkan"):
        return "out.png"
    if command.startswith("compress") or command in ("decompress", "transcode"):
        return "out.glb"
    return "page" if command == "view-export" else ""


def _glb(text: bytes, binary: bytes) -> bytes:
    marker = glb_bytes({}, binary)
    rest = marker[24:]  # after the header, the JSON chunk's header and "{}  "
    text += b" " * (-len(text) % 4)
    length = 20 + len(text) + len(rest)
    head = marker[:8] + length.to_bytes(4, "little") + len(text).to_bytes(4, "little")
    return head + marker[16:20] + text + rest


@contextlib.contextmanager
def _serving(folder: Path) -> Iterator[ViewServer]:
    model = Model("none", File(folder / "none.glb", 0), None, None, ())
    uploads = folder / "uploads"
    uploads.mkdir()
    with ViewServer(model, uploads) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


@contextlib.contextmanager
def _one_renderer() -> Iterator[None]:
    """One Vulkan device for all pictures: a new one would compile the shaders for each."""
    from vk_backend.renderer import Renderer

    with Renderer() as renderer:

        def shared(*_: object, **__: object) -> contextlib.AbstractContextManager[Renderer]:
            return contextlib.nullcontext(renderer)

        with mock.patch("vk_backend.command.Renderer", shared):
            yield


# --- memory ---


def _reset_peak() -> int:
    """Starts measuring the most memory that the process has at a time; returns what it has."""
    Path("/proc/self/clear_refs").write_text("5")
    return _status("VmRSS")


def _peak() -> int:
    return _status("VmHWM")


def _status(name: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(name):
            return int(line.split()[1]) * 1024
    raise LookupError(name)


def missing(commands: Iterable[str]) -> dict[str, str]:
    """The commands that cannot do their work on this machine, with the reasons."""
    found = {}
    for command in commands:
        try:
            if command in PACKAGES:
                importlib.import_module(PACKAGES[command])
            if command == "vulkan":
                importlib.import_module("vk_backend.renderer").Renderer().close()
        except (ImportError, MeshletError) as error:
            found[command] = str(error)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.fuzz", description=__doc__)
    parser.add_argument("mutants", type=int, nargs="?", default=MUTANTS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first mutant")
    parser.add_argument("--only", type=int, help="one mutant")
    parser.add_argument("--commands", nargs="+", choices=ALL, default=ALL)
    parser.add_argument("--each", type=int, default=1, help="commands for each mutant")
    parser.add_argument("--keep-going", action="store_true", help="report all failures")
    options = parser.parse_args()
    faulthandler.enable()
    without = missing(options.commands)
    for command, reason in without.items():
        print(f"without {command}: {reason}")
    commands = tuple(command for command in options.commands if command not in without)
    numbers = range(options.first, options.first + options.mutants)
    failed = 0
    with Fuzzer(options.seed, commands, options.each) as fuzzer:
        print(f"after a crash, the file is in {fuzzer.inputs}", flush=True)
        for number in numbers if options.only is None else [options.only]:
            try:
                fuzzer.run(number)
            except Exception:
                failed += 1
                if not options.keep_going:
                    raise
        print(f"{options.mutants} mutants of seed {options.seed}, {failed} failures")
        print(fuzzer.counts.table())
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
