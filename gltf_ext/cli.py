"""The command line: gltf-meshlet compress | decompress | inspect | verify | validate | demo."""

from __future__ import annotations

import argparse
import json
import os
import sys
from typing import Any

import gltf_ext
from gltf_ext.errors import MeshletError

PROGRAM = "gltf-meshlet"
DIFFERENT, FAILED, INTERRUPTED = 1, 2, 130  # exit statuses


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, 1 when verify finds a difference, 2 for errors."""
    options = _parser().parse_args(arguments)
    try:
        return options.run(options)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except MeshletError as error:
        return _fail(error.path or "", str(error))
    except OSError as error:
        return _fail(str(error.filename or ""), f"{error.strerror or error}; check the path and its permissions")
    except MemoryError:
        return _fail(str(getattr(options, "input", "")), "there is not enough memory; split the model")
    except KeyboardInterrupt:
        return INTERRUPTED


def _fail(path: str, message: str) -> int:
    print(": ".join(part for part in (PROGRAM, path, message) if part), file=sys.stderr)
    return FAILED


def _warn(path: str, warnings: list[str]) -> None:
    for warning in warnings:
        print(f"{PROGRAM}: {path}: warning: {warning}", file=sys.stderr)


# --- commands --------------------------------------------------------------------------------------------------------

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
        options.input, options.output, progress=True, **{name: getattr(options, name) for name in COMPRESS_OPTIONS}
    )
    _warn(options.input, report["warnings"] + _dropped(report["dropped"]) + _kept(report["kept"]))
    totals = report["totals"]
    print(
        f"{_sizes(report)}: {totals['ratio']:.2f} times smaller geometry, "
        f"{totals['bits_per_triangle']['total']:.2f} bits per triangle, {totals['triangles']:,} triangles in "
        f"{totals['meshlets']:,} meshlets ({totals['mean_triangles_per_meshlet']:.1f} on average)"
    )
    return 0


def _dropped(dropped: dict[str, int]) -> list[str]:
    kinds = (
        ("degenerate_triangles", "degenerate triangles are dropped"),
        ("incomplete_triangles", "primitives end in an incomplete triangle, which is dropped"),
    )
    return [f"{dropped[name]:,} {text}" for name, text in kinds if dropped[name]]


def _kept(kept: list[dict[str, Any]]) -> list[str]:
    return [f"mesh {k['mesh']} primitive {k['primitive']} is left as it is: {k['reason']}" for k in kept]


def _decompress(options: argparse.Namespace) -> int:
    report = gltf_ext.decompress(options.input, options.output, progress=True)
    _warn(options.input, report["warnings"])
    print(f"{_sizes(report)}: {report['triangles']:,} triangles")
    return 0


def _sizes(report: dict[str, Any]) -> str:
    return " -> ".join(
        f"{os.path.basename(report[which])} ({report[which + '_bytes'] / 1e6:.2f} MB)" for which in ("input", "output")
    )


def _inspect(options: argparse.Namespace) -> int:
    report = gltf_ext.inspect(options.input)
    if options.json:
        print(json.dumps(report, indent=2))
        return 0
    totals = report["totals"]
    rows = [
        ("triangles", f"{totals['triangles']:,}"),
        ("vertices", f"{totals['vertices']:,} ({totals['source_vertices']:,} before encoding)"),
        ("meshlets", f"{totals['meshlets']:,}, {totals['mean_triangles_per_meshlet']:.2f} triangles on average"),
        ("raw", f"{totals['raw_bytes']:,} bytes"),
        ("compressed", f"{totals['compressed_bytes']:,} bytes"),
        ("ratio", f"{totals['ratio']:.2f}"),
        ("bits per triangle", f"{totals['bits_per_triangle']['total']:.3f}"),
        *(
            (f"  {part.replace('_', ' ')}", f"{bits:.3f}")
            for part, bits in totals["bits_per_triangle"].items()
            if part != "total"
        ),
        ("symbols", ", ".join(f"{symbol} {100 * share:.1f} %" for symbol, share in totals["symbols"].items())),
    ]
    print(f"{report['file']} ({report['file_bytes'] / 1e6:.2f} MB)")
    print("\n".join(f"{name:26}{value}" for name, value in rows))
    for primitive in report["primitives"]:
        print(_primitive_line(primitive))
    return 0


def _primitive_line(primitive: dict[str, Any]) -> str:
    place = f"mesh {primitive['mesh']} primitive {primitive['primitive']}" + (
        f" ({primitive['name']})" if primitive["name"] else ""
    )
    if "shares_buffer_view_of" in primitive:
        mesh, index = primitive["shares_buffer_view_of"]
        return f"{place}: the same data as mesh {mesh} primitive {index}"
    attributes = ", ".join(
        f"{name} {'+'.join(map(str, a['bits_per_component']))}" for name, a in primitive["attributes"].items()
    )
    return (
        f"{place}: {primitive['triangles']:,} triangles, {primitive['meshlets']:,} meshlets, "
        f"ratio {primitive['ratio']:.2f}, "
        f"{primitive['bits_per_triangle']['total']:.2f} bits per triangle; bits: {attributes}"
    )


def _verify(options: argparse.Namespace) -> int:
    report = gltf_ext.verify(options.input, options.compressed)
    if options.json:
        print(
            json.dumps(
                {name: value if name != "error_over_bound" else _finite(value) for name, value in report.items()},
                indent=2,
            )
        )
    else:
        print(
            f"{'the same' if report['triangles_equal'] else 'NOT THE SAME'}: {report['triangles']:,} triangles, "
            f"{report['missing_triangles']:,} missing, {report['extra_triangles']:,} extra"
        )
        for name, largest in report["max_error"].items():
            degrees = report["max_error_degrees"].get(name)
            print(
                f"{name:20} largest error {largest:.3g} ({report['max_error_percent'][name]:.3g} % of the box"
                + (f", {degrees:.3g} degrees" if degrees is not None else "")
                + f"), RMS {report['rms_error'][name]:.3g} ({report['rms_error_percent'][name]:.3g} %)"
            )
        for problem in report["problems"]:
            print(problem)
    return 0 if report["ok"] else DIFFERENT


def _finite(errors: dict[str, float]) -> dict[str, float | None]:
    """JSON has no infinity."""
    return {name: value if value != float("inf") else None for name, value in errors.items()}


def _validate(options: argparse.Namespace) -> int:
    problems = gltf_ext.validate(options.input)
    for problem in problems:
        _fail(options.input, problem)
    if not problems:
        print(f"{options.input}: valid")
    return FAILED if problems else 0


def _demo(options: argparse.Namespace) -> int:
    from gltf_ext import demo

    return demo.main(options.output) or 0


# --- arguments -------------------------------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Usage errors in one line."""

    def error(self, message: str) -> None:
        self.exit(FAILED, f"{self.prog}: {message}; see {self.prog} --help\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog=PROGRAM, description="Triangle meshlets compressed with the glTF extension EXT_meshlet_edgebreaker."
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {gltf_ext.__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_compress(commands)
    command = _add_command(
        commands, "decompress", _decompress, "write a compressed file as a plain .glb", "compressed .glb or .gltf"
    )
    command.add_argument("output", metavar="OUT.glb")
    command = _add_command(
        commands,
        "inspect",
        _inspect,
        "show what a compressed file holds and where its bits go",
        "compressed .glb or .gltf",
    )
    command.add_argument("--json", action="store_true", help="for machines")
    command = _add_command(
        commands,
        "verify",
        _verify,
        "compare a compressed file with its original; exit status 1 when it differs",
        "the original",
        "ORIGINAL",
    )
    command.add_argument("compressed", metavar="COMPRESSED")
    command.add_argument("--json", action="store_true", help="for machines")
    _add_command(
        commands,
        "validate",
        _validate,
        "check a compressed file's structure and decode all of it",
        "compressed .glb or .gltf",
        "FILE",
    )
    command = commands.add_parser("demo", help="compress a generated model, verify it and draw pictures")
    command.add_argument(
        "output", metavar="FOLDER", nargs="?", default="demo-output", help="where to save (default %(default)s)"
    )
    command.set_defaults(run=_demo)
    return parser


def _add_command(commands, name: str, run, help: str, input_help: str, metavar: str = "IN") -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=help, description=help[0].upper() + help[1:] + ".")
    command.add_argument("input", metavar=metavar, help=input_help)
    command.set_defaults(run=run)
    return command


def _add_compress(commands) -> None:
    command = _add_command(commands, "compress", _compress, "compress a model into a .glb", ".glb .gltf .obj .ply .stl")
    command.add_argument("output", metavar="OUT.glb")
    for flag, name, default, text in (
        ("-vp", "position", 12, "positions, 4 to 24"),
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
            help=f"bits for {text} (default %(default)s)",
        )
    command.add_argument("--step", type=float, help="position step in model units, instead of -vp")
    command.add_argument(
        "--grid", choices=("mesh", "scene"), default="mesh", help="what shares one position grid (default %(default)s)"
    )
    command.add_argument(
        "--max-triangles", type=int, default=64, metavar="N", help="per meshlet, 16 to 64 (default %(default)s)"
    )
    command.add_argument(
        "--lambda", dest="lambda_", type=float, metavar="X", help="planar (small) or compact (large) meshlets"
    )
    command.add_argument("--iterations", type=int, metavar="N", help="at most so many rounds of meshlet generation")
    command.add_argument(
        "--fill", type=float, metavar="X", help="size that meshlet generation aims at, as a share of --max-triangles"
    )
    command.add_argument(
        "--weight",
        choices=("paper", "choe"),
        default="paper",
        help="meshlet generation: with or without the size penalty C(N)",
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
