"""The command line: gltf-meshlet compress | decompress | inspect | verify | validate | ..."""

from __future__ import annotations

import argparse
import errno
import io
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from importlib import import_module
from typing import Any, NoReturn, TextIO

import gltf_ext
from gltf_ext.errors import MeshletError, printable
from gltf_ext.portable import IS_WINDOWS, is_too_long
from gltf_meshlet import report_text

PROGRAM = "gltf-meshlet"
OUTPUT = "standard output"
DIFFERENT, FAILED, INTERRUPTED = 1, 2, 130  # exit statuses
DEFAULT_REMEDY = "check the path and its permissions"
REMEDIES = {
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "free some space",
    errno.EROFS: "choose a folder that can be written to",
    errno.EACCES: "check its permissions",
    errno.EPERM: "check its permissions",
    errno.EISDIR: "name a file",
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path",
    errno.EBADF: "open it, or send it to a file",
    errno.EMFILE: "raise the limit: ulimit -n 1024",
    errno.ENFILE: "close other programs",
    errno.ENAMETOOLONG: "choose a shorter name",
}

Command = Callable[[argparse.Namespace], int]  # returns the exit status


def main(arguments: list[str] | None = None) -> int:
    """Run the command line.

    Returns the exit status: 0, 1 when verify finds a difference, 2 for errors, 130 for Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    options = _parser().parse_args(arguments)
    try:
        with redirect_stdout(_Output(sys.stdout)):
            status: int = options.run(options)
            sys.stdout.flush()
        return status
    except MeshletError as error:
        return _fail(error.path or "", _with_flags(error))
    except OSError as error:
        return _fail_for(error, str(getattr(options, "input", "")))
    except MemoryError:
        path = str(getattr(options, "input", ""))
        return _fail(path, "there is not enough memory; split the model")
    except KeyboardInterrupt:
        return INTERRUPTED


class _Output:
    """Standard output whose errors name it: errors of other things may name no file, too.

    It may be closed from the start: then Python has none.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        with _errors_name_output():
            if self._stream is None:
                raise OSError(errno.EBADF, "it is closed")
            return self._stream.write(text)

    def flush(self) -> None:
        with _errors_name_output():
            if self._stream is not None:
                self._stream.flush()


@contextmanager
def _errors_name_output() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = OUTPUT
        raise


def _fail_for(error: OSError, input: str = "") -> int:
    """input: of the command, for an error that names no file."""
    if error.filename is OUTPUT:
        _discard_output()
        # Whoever reads it has seen enough; EINVAL is what C calls a broken pipe on Windows.
        if isinstance(error, BrokenPipeError) or (IS_WINDOWS and error.errno == errno.EINVAL):
            return FAILED
    path = os.fsdecode(error.filename or input)
    remedy = REMEDIES.get(error.errno or 0, DEFAULT_REMEDY if error.filename else "run again")
    if isinstance(error, PermissionError) and IS_WINDOWS:
        remedy += ", and close other programs that use it"
    if isinstance(error, FileNotFoundError) and is_too_long(path):
        remedy = "it may be too long: enable long paths in Windows, or choose a shorter one"
    return _fail(path, f"{error.strerror or error}; {remedy}")


def _discard_output() -> None:
    """Sends buffered standard output nowhere: Python would fail to flush it at exit."""
    if sys.stdout is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _with_flags(error: MeshletError) -> str:
    """The message with the command line's names of options."""
    from gltf_ext.options import FLAGS

    message = error.message
    for name in error.options:
        message = message.replace(name, FLAGS.get(name, "--" + name.replace("_", "-")), 1)
    return message


def _fail(path: str, message: str) -> int:
    parts = (PROGRAM, printable(path), message)
    print(": ".join(part for part in parts if part), file=sys.stderr)
    return FAILED


def _warn(path: str, warnings: list[str]) -> None:
    for warning in warnings:
        print(f"{PROGRAM}: {printable(path)}: warning: {printable(warning)}", file=sys.stderr)


def report_cut_files() -> None:
    """Ends the process with one line when another program cuts off a file that it has mapped into
    memory: the system sends SIGBUS to whoever reads what is gone, in Python or in the codec."""
    import ctypes
    import signal

    if not hasattr(signal, "SIGBUS"):  # Windows refuses to cut mapped files off
        return

    @ctypes.CFUNCTYPE(None, ctypes.c_int)
    def end(number: int) -> None:
        os.write(2, f"{PROGRAM}: a file was cut off while it was read; run again\n".encode())
        os._exit(FAILED)

    ctypes.CDLL(None).signal(signal.SIGBUS, end)
    report_cut_files.handler = end  # type: ignore[attr-defined]  # as long as the process


# --- commands ---


def _compress(options: argparse.Namespace) -> int:
    from gltf_meshlet import compress_options

    values_of = compress_options.values_of(options)
    report = gltf_ext.compress(options.input, options.output, progress=True, **values_of)
    _warn(options.input, gltf_ext.compress_warnings(report))
    print(report_text.compress_summary(report))
    if report["steps"]:
        print(report_text.steps_line(report))
    return 0


def _decompress(options: argparse.Namespace) -> int:
    report = gltf_ext.decompress(
        options.input, options.output, level=options.level, error=options.error, progress=True
    )
    _warn(options.input, report["warnings"])
    triangles = report_text.plural(report["triangles"], "triangle")
    print(f"{report_text.sizes(report)}: {triangles}")
    return 0


def _transcode(options: argparse.Namespace) -> int:
    report = gltf_ext.transcode(options.input, options.output, threads=options.threads)
    print(f"{report_text.sizes(report)}: {'packed' if report['packed'] else 'unpacked'}")
    return 0


def _inspect(options: argparse.Namespace) -> int:
    report = gltf_ext.inspect(options.input)
    if options.json:
        print(json.dumps(report, indent=2))
    else:
        print(report_text.inspect_table(report, options.all))
    return 0


def _verify(options: argparse.Namespace) -> int:
    names = ("max_memory", "work_dir", "obj_groups")
    settings = {name: getattr(options, name) for name in names}
    report = gltf_ext.verify(options.input, options.compressed, progress=True, **settings)
    _warn(options.compressed, report["warnings"])
    if options.json:
        print(json.dumps(report_text.verify_json(report), indent=2))
    else:
        print(report_text.verify_text(report))
    return 0 if report["ok"] else DIFFERENT


def _validate(options: argparse.Namespace) -> int:
    problems = gltf_ext.validate(options.input, progress=True)
    for problem in problems:
        _fail(options.input, problem)
    if problems:
        return FAILED
    count = sum(decoder.meshlet_count for decoder in gltf_ext.decoders(options.input))
    meshlets = report_text.plural(count, "meshlet")
    print(f"{printable(options.input)}: well formed: {meshlets} decoded")
    return 0


# --- arguments ---

COMPRESSED_HELP = "file that compress wrote"
JSON_HELP = "print JSON instead of the table"


AddArguments = Callable[[argparse.ArgumentParser], None]


class _Parser(argparse.ArgumentParser):
    """Prints usage errors in one line, and adds the arguments of a command when it is used.

    The arguments of all commands would double the time that any command takes to start.
    """

    def __init__(self, add_arguments: AddArguments | None = None, **keywords: Any) -> None:
        super().__init__(**keywords)
        self._add_arguments = add_arguments

    def complete(self) -> None:
        """Adds the arguments."""
        if self._add_arguments is not None:
            self._add_arguments(self)
            self._add_arguments = None

    def parse_known_args(self, *arguments: Any, **keywords: Any) -> Any:
        """Refuses unknown arguments here, so that the error names the help of the command."""
        self.complete()
        options, unknown = super().parse_known_args(*arguments, **keywords)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return options, unknown

    def error(self, message: str) -> NoReturn:
        self.exit(FAILED, f"{self.prog}: {message}; see {self.prog} --help\n")


def _parser() -> _Parser:
    parser = _Parser(
        prog=PROGRAM,
        description="Triangle meshlets compressed with the glTF extension EXT_meshlet_edgebreaker.",
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {gltf_ext.__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, (run, add_arguments, help) in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=help,
            description=help[0].upper() + help[1:] + ".",
            add_arguments=add_arguments,
        )
        command.set_defaults(run=run)
    return parser


def _add_compress(command: argparse.ArgumentParser) -> None:
    from gltf_meshlet import compress_options

    command.add_argument("input", metavar="IN", help=".glb .gltf .obj .ply .stl")
    command.add_argument("output", metavar="OUT.glb", help="file to write; or .gltf")
    compress_options.add(command)


def _add_decompress(command: argparse.ArgumentParser) -> None:
    command.add_argument("input", metavar="IN", help=COMPRESSED_HELP)
    command.add_argument("output", metavar="OUT.glb", help="file to write; or .gltf")
    detail = command.add_mutually_exclusive_group()
    detail.add_argument(
        "--level",
        type=int,
        metavar="K",
        help="write level of detail K, 0 for all triangles; a primitive with fewer levels takes "
        "its coarsest one",
    )
    detail.add_argument(
        "--error",
        metavar="X",
        help="write the coarsest mesh with at most this error, in units of the scene, or 0.1%% of "
        "each primitive's longest side",
    )


def _add_transcode(command: argparse.ArgumentParser) -> None:
    command.add_argument("input", metavar="IN", help=COMPRESSED_HELP)
    command.add_argument("output", metavar="OUT.glb", help="file to write; or .gltf")
    command.add_argument(
        "--threads", type=int, default=0, metavar="N", help="0, the default: one per processor"
    )


def _add_inspect(command: argparse.ArgumentParser) -> None:
    command.add_argument("input", metavar="IN", help=COMPRESSED_HELP)
    command.add_argument("--json", action="store_true", help=JSON_HELP)
    limit = report_text.MAX_PRIMITIVES
    command.add_argument(
        "--all", action="store_true", help=f"all primitives, not the {limit} largest"
    )


def _add_verify(command: argparse.ArgumentParser) -> None:
    command.add_argument("input", metavar="ORIGINAL", help="the original")
    command.add_argument("compressed", metavar="COMPRESSED", help=COMPRESSED_HELP)
    command.add_argument(
        "--max-memory",
        metavar="BYTES",
        help="read models larger than memory in parts; the process stays below about so many bytes "
        "(K, M and G are powers of 1024)",
    )
    command.add_argument(
        "--work-dir",
        metavar="FOLDER",
        help="folder for the work files of --max-memory; by default the system's",
    )
    command.add_argument(
        "--obj-groups", action="store_true", help="for an .obj that was compressed with it"
    )
    command.add_argument("--json", action="store_true", help=JSON_HELP)


def _add_validate(command: argparse.ArgumentParser) -> None:
    command.add_argument("input", metavar="FILE", help=COMPRESSED_HELP)


def _of_module(name: str) -> tuple[Command, AddArguments]:
    """Functions that import the module of a command when they are called."""
    return (
        lambda options: import_module(name).run(options),
        lambda command: import_module(name).add_arguments(command),
    )


# Name -> the function that runs it, the one that adds its arguments, its help.
COMMANDS: dict[str, tuple[Command, AddArguments, str]] = {
    "compress": (_compress, _add_compress, "compress a model into a .glb"),
    "batch": (
        *_of_module("gltf_meshlet.batch_command"),
        "compress and verify many models, on this machine or a cluster",
    ),
    "decompress": (_decompress, _add_decompress, "write a compressed file as a plain .glb"),
    "transcode": (
        _transcode,
        _add_transcode,
        "pack a compressed file for download, or unpack a packed one",
    ),
    "inspect": (
        _inspect,
        _add_inspect,
        "show the contents of a compressed file and where its bits go",
    ),
    "verify": (
        _verify,
        _add_verify,
        "compare a compressed file with its original; exit status 1 when it differs",
    ),
    "validate": (
        _validate,
        _add_validate,
        "check a compressed file's structure and decode all of it",
    ),
    "render": (
        *_of_module("gltf_meshlet.render_command"),
        "draw a picture of a file without decompressing it",
    ),
    "view": (
        *_of_module("gltf_meshlet.view_command"),
        "show a model in the browser, compressed and beside its original",
    ),
    "gpu-check": (
        *_of_module("gltf_meshlet.gpu_check_command"),
        "draw a generated scene in every way with Vulkan, and compare it with the CPU; exit "
        "status 1 when a path draws it wrong",
    ),
    "demo": (
        *_of_module("gltf_meshlet.demo.run"),
        "compress a generated model, verify it and draw pictures",
    ),
}


if __name__ == "__main__":
    sys.exit(main())
