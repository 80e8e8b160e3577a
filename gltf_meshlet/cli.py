"""The command line: gltf-meshlet compress | decompress | inspect | verify | validate | render | demo."""

from __future__ import annotations

import argparse
import errno
import json
import math
import os
import sys
from typing import Any

import gltf_ext
from gltf_ext.errors import MeshletError
from gltf_meshlet import render

PROGRAM = "gltf-meshlet"
DIFFERENT, FAILED, INTERRUPTED = 1, 2, 130  # exit statuses


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, 1 when verify finds a difference, 2 for errors."""
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="backslashreplace")
    options = _parser().parse_args(arguments)
    try:
        status = options.run(options)
        sys.stdout.flush()
        return status
    except BrokenPipeError:
        _discard_output()
        return FAILED
    except MeshletError as error:
        return _fail(error.path or "", _with_flags(error))
    except OSError as error:
        if not error.filename:
            _discard_output()
        remedy = REMEDIES.get(error.errno or 0, "check the path and its permissions")
        return _fail(
            os.fsdecode(error.filename or "standard output"), f"{error.strerror or error}; {remedy}"
        )
    except MemoryError:
        return _fail(
            str(getattr(options, "input", "")), "there is not enough memory; split the model"
        )
    except KeyboardInterrupt:
        return INTERRUPTED


def _discard_output() -> None:
    """What standard output still holds goes nowhere, or Python would fail again at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _with_flags(error: MeshletError) -> str:
    """The message with the command line's names of options."""
    message = error.message
    for name in error.options:
        message = message.replace(
            name, FLAGS.get(name, "--" + name.rstrip("_").replace("_", "-")), 1
        )
    return message


def _fail(path: str, message: str) -> int:
    print(": ".join(part for part in (PROGRAM, path, message) if part), file=sys.stderr)
    return FAILED


def _warn(path: str, warnings: list[str]) -> None:
    for warning in warnings:
        print(f"{PROGRAM}: {path}: warning: {warning}", file=sys.stderr)


REMEDIES = {
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "free some space",
    errno.EROFS: "choose a folder that can be written to",
    errno.EACCES: "check its permissions",
    errno.EPERM: "check its permissions",
    errno.EISDIR: "name a file",
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path",
    errno.ENAMETOOLONG: "choose a shorter name",
}
FLAGS = {
    "position_bits": "-vp",
    "normal_bits": "-vn",
    "texcoord_bits": "-vt",
    "color_bits": "-vc",
    "weight_bits": "-vw",
}

# --- commands ---

COMPRESS_OPTIONS = (
    "position_bits",
    "normal_bits",
    "texcoord_bits",
    "color_bits",
    "weight_bits",
    "step",
    "grid",
    "max_triangles",
    "lambda_",
    "iterations",
    "fill",
    "weight",
    "fallback",
    "threads",
)


def _compress(options: argparse.Namespace) -> int:
    report = gltf_ext.compress(
        options.input,
        options.output,
        progress=True,
        **{name: getattr(options, name) for name in COMPRESS_OPTIONS},
    )
    _warn(options.input, report["warnings"] + _dropped(report["dropped"]) + _kept(report["kept"]))
    totals = report["totals"]
    print(
        f"{_sizes(report)}, {report['input_bytes'] / report['output_bytes']:.2f} times smaller; "
        f"geometry {totals['ratio']:.2f} times smaller than raw floats, "
        f"{totals['bits_per_triangle']['total']:.2f} bits per triangle, {_count(totals['triangles'], 'triangle')} in "
        f"{_count(totals['meshlets'], 'meshlet')} ({totals['mean_triangles_per_meshlet']:.1f} on average)"
    )
    return 0


def _dropped(dropped: dict[str, int]) -> list[str]:
    kinds = (
        ("degenerate_triangles", "degenerate triangles are dropped"),
        ("incomplete_triangles", "primitives end in an incomplete triangle, which is dropped"),
    )
    return [f"{dropped[name]:,} {text}" for name, text in kinds if dropped[name]]


def _kept(kept: list[dict[str, Any]]) -> list[str]:
    return [
        f"mesh {k['mesh']} primitive {k['primitive']} is left as it is: {k['reason']}" for k in kept
    ]


def _decompress(options: argparse.Namespace) -> int:
    report = gltf_ext.decompress(options.input, options.output, progress=True)
    _warn(options.input, report["warnings"])
    print(f"{_sizes(report)}: {_count(report['triangles'], 'triangle')}")
    return 0


def _sizes(report: dict[str, Any]) -> str:
    before, after = (
        f"{os.path.basename(report[which])} ({_size(report[which + '_bytes'])})"
        for which in ("input", "output")
    )
    fallback = (
        f"{name} ({_size(size)})" for name, size in report.get("fallback_files", {}).items()
    )
    return f"{before} -> {' + '.join([after, *fallback])}"


def _size(count: int) -> str:
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= factor:
            return f"{count / factor:.{1 if unit == 'kB' else 2}f} {unit}"
    return f"{count} B"


def _count(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


PART_LABELS = {"texcoords": "texture coordinates", "other": "other attributes"}
SHOWN_PRIMITIVES = 10


def _inspect(options: argparse.Namespace) -> int:
    report = gltf_ext.inspect(options.input)
    if options.json:
        print(json.dumps(report, indent=2))
        return 0
    totals = report["totals"]
    rows = [
        ("triangles", f"{totals['triangles']:,}"),
        (
            "vertices",
            f"{totals['vertices']:,} ({totals['source_vertices']:,} distinct in the source)",
        ),
        (
            "meshlets",
            f"{totals['meshlets']:,}, {totals['mean_triangles_per_meshlet']:.2f} triangles on average",
        ),
        ("raw", f"{totals['raw_bytes']:,} bytes"),
        ("compressed", f"{totals['compressed_bytes']:,} bytes"),
        ("ratio", f"{totals['ratio']:.2f}"),
        ("bits per triangle", f"{totals['bits_per_triangle']['total']:.3f}"),
        *(
            (f"  {PART_LABELS.get(part, part.replace('_', ' '))}", f"{bits:.3f}")
            for part, bits in totals["bits_per_triangle"].items()
            if bits and part != "total"
        ),
        (
            "symbols",
            ", ".join(
                f"{symbol} {100 * share:.1f} %" for symbol, share in totals["symbols"].items()
            ),
        ),
    ]
    rows += [
        ("fallback", f"{size:,} bytes in {name}") for name, size in report["fallback_files"].items()
    ]
    print(f"{report['file']} ({_size(report['file_bytes'])})")
    print("\n".join(f"{name:26}{value}" for name, value in rows))
    primitives = report["primitives"] if options.all else _largest(report["primitives"])
    for primitive in primitives:
        print(_primitive_line(primitive))
    if len(primitives) < len(report["primitives"]):
        print(
            f"the {len(primitives)} largest of {len(report['primitives']):,} primitives; --all shows every one"
        )
    return 0


def _largest(primitives: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The primitives with most triangles, in the file's order."""
    by_size = sorted(primitives, key=lambda primitive: -primitive.get("triangles", 0))[
        :SHOWN_PRIMITIVES
    ]
    return [primitive for primitive in primitives if any(primitive is kept for kept in by_size)]


def _primitive_line(primitive: dict[str, Any]) -> str:
    place = f"mesh {primitive['mesh']} primitive {primitive['primitive']}" + (
        f" ({primitive['name']})" if primitive["name"] else ""
    )
    if "shares_buffer_view_of" in primitive:
        mesh, index = primitive["shares_buffer_view_of"]
        return f"{place}: the same data as mesh {mesh} primitive {index}"
    attributes = ", ".join(
        f"{name} {'+'.join(map(str, a['bits_per_component']))}"
        for name, a in primitive["attributes"].items()
    )
    return (
        f"{place}: {_count(primitive['triangles'], 'triangle')}, {_count(primitive['meshlets'], 'meshlet')}, "
        f"ratio {primitive['ratio']:.2f}, "
        f"{primitive['bits_per_triangle']['total']:.2f} bits per triangle; bits: {attributes}; "
        f"position step {primitive['attributes']['POSITION']['step'][0]:.3g}"
    )


def _verify(options: argparse.Namespace) -> int:
    report = gltf_ext.verify(options.input, options.compressed)
    if options.json:
        print(
            json.dumps(
                {
                    name: value if name != "error_over_bound" else _finite(value)
                    for name, value in report.items()
                },
                indent=2,
            )
        )
    else:
        print(
            f"{_verdict(report)}: {_count(report['triangles'], 'triangle')}, "
            f"{report['missing_triangles']:,} missing, {report['extra_triangles']:,} extra"
            + (
                f", {report['collapsed_triangles']:,} collapsed by the grid"
                if report["collapsed_triangles"]
                else ""
            )
        )
        for name, largest in report["max_error"].items():
            if largest is None:
                print(f"{name:20} not compared")
                continue
            degrees = report["max_error_degrees"].get(name)
            percent, rms = report["max_error_percent"][name], report["rms_error"][name]
            print(
                f"{name:20} largest error "
                + (
                    f"{largest:.3g} ({percent:.3g} % of the box's diagonal)"
                    if degrees is None
                    else f"{degrees:.3g} degrees"
                )
                + f", RMS {rms if degrees is None else math.degrees(rms):.3g}"
                + ("" if degrees is None else " degrees")
            )
        for problem in report["problems"]:
            print(problem)
    return 0 if report["ok"] else DIFFERENT


def _verdict(report: dict[str, Any]) -> str:
    if not report["triangles_equal"]:
        return "NOT THE SAME"
    return "the same triangles, " + ("within the bits" if report["ok"] else "BEYOND THE BITS")


def _finite(errors: dict[str, float]) -> dict[str, float | None]:
    """JSON has no infinity."""
    return {name: value if value != float("inf") else None for name, value in errors.items()}


def _validate(options: argparse.Namespace) -> int:
    problems = gltf_ext.validate(options.input)
    for problem in problems:
        _fail(options.input, problem)
    if not problems:
        meshlets = sum(decoder.meshlet_count for decoder in gltf_ext.decoders(options.input))
        print(f"{options.input}: well formed: {_count(meshlets, 'meshlet')} decoded")
    return FAILED if problems else 0


def _demo(options: argparse.Namespace) -> int:
    from gltf_meshlet.demo import run

    return run.main(options.output) or 0


# --- arguments ---


JSON_HELP = "print JSON instead of the table"


class _Parser(argparse.ArgumentParser):
    """Usage errors in one line."""

    def parse_known_args(self, *arguments, **keywords):
        """A command refuses what it does not know itself, so that its own help is named."""
        options, unknown = super().parse_known_args(*arguments, **keywords)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return options, unknown

    def error(self, message: str) -> None:
        self.exit(FAILED, f"{self.prog}: {message}; see {self.prog} --help\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog=PROGRAM,
        description="Triangle meshlets compressed with the glTF extension EXT_meshlet_edgebreaker.",
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {gltf_ext.__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_compress(commands)
    command = _add_command(
        commands,
        "decompress",
        _decompress,
        "write a compressed file as a plain .glb",
        "file that compress wrote",
    )
    command.add_argument("output", metavar="OUT.glb", help="file to write")
    command = _add_command(
        commands,
        "inspect",
        _inspect,
        "show what a compressed file holds and where its bits go",
        "file that compress wrote",
    )
    command.add_argument("--json", action="store_true", help=JSON_HELP)
    command.add_argument(
        "--all", action="store_true", help=f"all primitives, not the {SHOWN_PRIMITIVES} largest"
    )
    command = _add_command(
        commands,
        "verify",
        _verify,
        "compare a compressed file with its original; exit status 1 when it differs",
        "the original",
        "ORIGINAL",
    )
    command.add_argument("compressed", metavar="COMPRESSED", help="file that compress wrote")
    command.add_argument("--json", action="store_true", help=JSON_HELP)
    _add_command(
        commands,
        "validate",
        _validate,
        "check a compressed file's structure and decode all of it",
        "file that compress wrote",
        "FILE",
    )
    command = _add_command(
        commands,
        "render",
        render.run,
        "draw a picture of a file without decompressing it",
        "file that compress wrote, or any model",
        "SCENE",
    )
    render.add_arguments(command)
    command = commands.add_parser(
        "demo", help="compress a generated model, verify it and draw pictures"
    )
    command.add_argument(
        "output",
        metavar="FOLDER",
        nargs="?",
        default="demo-output",
        help="where to save (default %(default)s)",
    )
    command.set_defaults(run=_demo)
    return parser


def _add_command(
    commands, name: str, run, help: str, input_help: str, metavar: str = "IN"
) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=help, description=help[0].upper() + help[1:] + ".")
    command.add_argument("input", metavar=metavar, help=input_help)
    command.set_defaults(run=run)
    return command


def _add_compress(commands) -> None:
    command = _add_command(
        commands, "compress", _compress, "compress a model into a .glb", ".glb .gltf .obj .ply .stl"
    )
    command.add_argument("output", metavar="OUT.glb", help="file to write")
    for flag, name, default, text in (
        ("-vp", "position", None, "positions, 4 to 24"),
        ("-vn", "normal", 8, "normals and tangents, 4 to 16"),
        ("-vt", "texcoord", 12, "texture coordinates, 4 to 16"),
        ("-vc", "color", 8, "colours that are not 8-bit, 4 to 16"),
        ("-vw", "weight", 8, "float skin weights, 4 to 16"),
    ):
        command.add_argument(
            flag,
            dest=f"{name}_bits",
            metavar="BITS",
            type=int,
            default=default,
            help=f"bits for {text} (default {default or 12})",
        )
    command.add_argument(
        "--step",
        type=float,
        metavar="X",
        help="position step in model units (0.001 is 1 mm when units are metres), instead of -vp",
    )
    command.add_argument(
        "--grid",
        choices=("mesh", "scene"),
        default="mesh",
        help="mesh: one grid per mesh; scene: one for the whole file (default %(default)s)",
    )
    command.add_argument(
        "--max-triangles",
        type=int,
        default=64,
        metavar="N",
        help="per meshlet, 16 to 64 (default %(default)s)",
    )
    command.add_argument(
        "--lambda",
        dest="lambda_",
        type=float,
        metavar="X",
        help="planar (small) or compact (large) meshlets, above 1 (default 1.4)",
    )
    command.add_argument(
        "--iterations",
        type=int,
        metavar="N",
        help="at most so many rounds of meshlet generation (default 12)",
    )
    command.add_argument(
        "--fill",
        type=float,
        metavar="X",
        help="size that meshlet generation aims at, as a share of --max-triangles, 0.25 to 1 (default 0.96)",
    )
    command.add_argument(
        "--weight",
        choices=("paper", "choe"),
        default="paper",
        help="paper: with the size penalty; choe: without (default %(default)s)",
    )
    command.add_argument(
        "--fallback",
        action="store_true",
        help="also write plain buffers, for readers without the extension, into OUT.fallback.bin",
    )
    command.add_argument(
        "--threads",
        type=int,
        default=0,
        metavar="N",
        help="0 is one per processor; the result is the same (default %(default)s)",
    )


if __name__ == "__main__":
    sys.exit(main())
