"""The options of `compress`, declared once.

The command line's arguments, the signature and the docstring of `compress` and the table in
docs/cli.md come from here: tools/option_docs.py writes the docstring and the table, and a test
compares them. Imports nothing heavy, so that `compress --help` is quick.
"""

from __future__ import annotations

import dataclasses
import numbers
import os
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin, get_type_hints

from gltf_ext.errors import MeshletError

MIN_POSITION_BITS = 4
AUTO = "auto"  # bits that compress chooses, for each primitive: attributes/choice.py
# A page of fewer bytes holds less than about ten meshlets, and mostly borders.
MIN_PAGE_BYTES, MAX_PAGE_BYTES = 4096, 1 << 28
LARGEST_NUMBER = 1e9
LARGEST_LAMBDA = 1000  # of the encoder
MEMORY_TEXT = "a number such as 2G or 800M"
DEFAULT_LOD_PAGE_BYTES = 32768
# By default, primitives of more triangles become pages. One with fewer decodes in at most 8 ms in a
# browser (bench/results/web.json). Pages of 128 KiB cost igea and dragon 0.8 and 0.7 % of their
# bytes, of 64 KiB 1.1 and 1.2 %, of 256 KiB 0.2 and 0.4 %, but igea then has only two of them.
MOST_TRIANGLES_UNPAGED, DEFAULT_PAGE_BYTES = 1 << 17, 1 << 17


@dataclass(frozen=True)
class Option:
    """How an option is shown and checked.

    Attributes:
        flag: on the command line; empty for an option that only Python has.
        help: one phrase, without limits and default.
        type: int, float, str or bool; a bool is a switch.
        limits: smallest and largest value, both allowed; None: any number above zero.
        maximum: largest number without limits.
        choices: for a str, from the field's Literal.
        optional: None is the default, and may be given.
        expectation: what a str without choices has to be.
        also: types of values beside str or bool.
        automatic: "auto" is a value, too.
        default: as shown; the value may be None if the encoder has the default.
        placeholder: what stands for the value in help texts; by default from the type.
        name: the keyword argument; set when the option is listed.
    """

    flag: str
    help: str
    type: type
    limits: tuple[float, float] | None = None
    maximum: float = LARGEST_NUMBER
    choices: tuple[str, ...] = ()
    optional: bool = False
    expectation: str = ""
    also: tuple[Any, ...] = ()
    automatic: bool = False
    default: str = ""
    placeholder: str = ""
    name: str = ""

    @property
    def metavar(self) -> str | None:
        """Placeholder of the value in help texts; None for a switch."""
        if self.type is bool:
            return None
        if self.placeholder:
            return self.placeholder
        if self.choices:
            return self.flag.strip("-").upper()
        if self.name.endswith("_bits"):
            return "BITS"
        return "N" if self.type is int else "X"

    @property
    def text(self) -> str:
        """The help with limits and default."""
        default = f"default {self.default}" if self.default else ""
        details = ", ".join(text for text in (self.limits_text, default) if text)
        return f"{self.help} ({details})" if details else self.help

    @property
    def limits_text(self) -> str:
        """The limits in words; empty for none."""
        if not self.limits:
            return ""
        limits = " to ".join(str(n) if isinstance(n, int) else f"{n:g}" for n in self.limits)
        return f"{limits} or {AUTO}" if self.automatic else limits

    @property
    def accepted(self) -> str:
        """The values that the option may have, in words."""
        if self.type is bool:
            return "True or False"
        if self.type is str:
            return " or ".join(self.choices) or self.expectation
        return self.limits_text or f"a number above 0 and up to {self.maximum:g}"

    def check(self, value: Any) -> None:
        """Raise MeshletError for a value that the option cannot have."""
        if not (self.optional if value is None else self._accepts(value)):
            raise MeshletError(
                f"{self.name} is {value!r}", f"use {self.accepted}", options=(self.name,)
            )

    def json_value(self, value: Any) -> Any:
        """Return a value that the option accepts as one of JSON, not a path or of NumPy."""
        if value is None or self.type is bool or self._is_auto(value):
            return value
        if self.type is not str:
            return self.type(value)
        if isinstance(value, os.PathLike):
            value = os.fsdecode(value)
        return str.__str__(value) if isinstance(value, str) else int(value)

    def from_text(self, text: str) -> Any:
        """Return the value that a text of the command line means. Raises ValueError."""
        return text if self._is_auto(text) else self.type(text)

    def _is_auto(self, value: Any) -> bool:
        return self.automatic and isinstance(value, str) and value == AUTO

    def _accepts(self, value: Any) -> bool:
        if self._is_auto(value):
            return True
        if self.type is bool or isinstance(value, bool):
            return self.type is bool and isinstance(value, (bool, *self.also))
        if self.type is str:
            fits = isinstance(value, (str, *self.also))
            return fits and (not self.choices or value in self.choices)
        is_number = isinstance(value, numbers.Integral if self.type is int else numbers.Real)
        if self.limits:
            low, high = self.limits
            return is_number and bool(low <= value <= high)
        return is_number and bool(0 < value <= self.maximum)


def _declare(value: Any, flag: str, help: str, **settings: Any) -> Any:
    """Return a field with its Option. `value`: the default, of the option's type or None."""
    if value is None:
        if "type" not in settings:
            raise TypeError(f"{flag} has no default, so name its type: _declare(..., type=float)")
        settings["optional"] = True
    else:
        settings.setdefault("type", type(value))
        settings.setdefault("default", "" if value is False else str(value))
    return dataclasses.field(default=value, metadata={"option": Option(flag, help, **settings)})


def _bits(flag: str, help: str) -> Any:
    """Return a field for bits of an attribute's elements; by default `compress` chooses them."""
    return _declare(AUTO, flag, help, type=int, limits=(4, 16), automatic=True)


def bytes_of(text: str) -> int:
    """Return the bytes that a text such as 2G, 800M, 16k or 4096 means. Raises ValueError."""
    match = re.fullmatch(r"(\d{1,15})([KMG]?)", text.strip().upper())
    if not match:
        raise ValueError(f"{text!r} is no number such as 2G or 800M")
    return int(match[1]) << 10 * " KMG".index(match[2] or " ")


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of `compress`. Raises MeshletError for a value that an option cannot have."""

    position_bits: int | Literal["auto"] | None = _declare(
        None,
        "-vp",
        "bits of a position along the longest side",
        type=int,
        limits=(MIN_POSITION_BITS, 24),
        automatic=True,
        default=AUTO,
    )
    normal_bits: int | Literal["auto"] = _bits(
        "-vn", "bits of each of the two elements of a normal or tangent"
    )
    texcoord_bits: int | Literal["auto"] = _bits("-vt", "bits of each texture coordinate")
    color_bits: int | Literal["auto"] = _bits(
        "-vc", "bits of each colour component that is not stored in 8 bits"
    )
    weight_bits: int | Literal["auto"] = _bits("-vw", "bits of each float skin weight")
    step: float | None = _declare(
        None,
        "--step",
        "position step in units of the scene, instead of bits: 0.001 is 1 mm if units are metres",
        type=float,
    )
    grid: Literal["mesh", "scene"] = _declare(
        "mesh",
        "--grid",
        "one position grid per mesh, or one for the whole scene",
    )
    max_triangles: int = _declare(
        64, "--max-triangles", "most triangles in a meshlet", limits=(16, 64)
    )
    lambda_: float | None = _declare(
        None,
        "--lambda",
        f"above 0 and up to {LARGEST_LAMBDA}; small values give planar meshlets, large ones "
        "compact meshlets",
        type=float,
        maximum=LARGEST_LAMBDA,
        default="1.4",
    )
    effort: Literal["fast", "normal"] = _declare(
        "normal",
        "--effort",
        "how long to look for a smaller file; against normal, fast takes about 0.6 of the time for "
        "2 % more bytes",
    )
    page_bytes: int | None = _declare(
        None,
        "--page-bytes",
        "largest size of a page, a blob of neighbouring meshlets that decodes alone; 0 for one "
        f"blob per primitive, else at least {MIN_PAGE_BYTES}; by default {DEFAULT_PAGE_BYTES} in "
        f"primitives of more than {MOST_TRIANGLES_UNPAGED} triangles, 0 in others; instead of 0, "
        f"{DEFAULT_LOD_PAGE_BYTES} with levels of detail, and {DEFAULT_PAGE_BYTES} in primitives "
        "that --max-memory reads in parts",
        type=int,
        limits=(0, MAX_PAGE_BYTES),
    )
    lod: bool = _declare(
        False,
        "--lod",
        "also write levels of detail (EXT_meshlet_lod), in pages of --page-bytes or "
        f"{DEFAULT_LOD_PAGE_BYTES} bytes; primitives that cannot be simplified have none; from "
        "source, needs the package meshoptimizer",
    )
    lod_reduction: float = _declare(
        5.0,
        "--lod-reduction",
        "triangles of level 0 over those of level 1; coarser levels shrink by less",
        limits=(1.5, 16.0),
    )
    lod_group: int = _declare(
        96, "--lod-group", "meshlets that are simplified together", limits=(4, 128)
    )
    lod_limit: float | None = _declare(
        None,
        "--lod-limit",
        "largest error of a level, in units of the scene; no limit by default",
        type=float,
    )
    fallback: bool = _declare(
        False,
        "--fallback",
        "also write plain buffers into OUT.fallback.bin, for readers without the extension",
    )
    images: Literal["embed", "keep"] = _declare(
        "embed",
        "--images",
        "embed images into the result, or keep them in their files, whose relative paths have to "
        "hold from where the output lies",
    )
    transport: bool = _declare(
        False,
        "--transport",
        "pack the result for download, a tenth to a third smaller (EXT_meshlet_transport, a "
        "draft); readers unpack it when they open it",
    )
    obj_groups: bool = _declare(
        False,
        "--obj-groups",
        "groups (g) of an .obj become nodes, too, below those of its objects (o)",
    )
    non_finite: Literal["repair", "refuse"] = _declare(
        "repair",
        "--non-finite",
        "of values that are NaN or infinite: repair leaves out triangles at such positions, "
        "computes normals again and sets texture coordinates to 0, with a warning each; refuse "
        "ends with an error",
    )
    threads: int = _declare(
        0,
        "--threads",
        "number of threads, 0 for one per processor; the bytes are the same for any",
        limits=(0, 1024),
    )
    max_memory: str | int | None = _declare(
        None,
        "--max-memory",
        "work through models larger than memory in chunks; the process stays below so many bytes "
        "(K, M and G are powers of 1024)",
        type=str,
        placeholder="BYTES",
        expectation=MEMORY_TEXT,
        also=(int,),
    )
    work_dir: str | None = _declare(
        None,
        "--work-dir",
        "folder for the work files of --max-memory; by default that of the output",
        type=str,
        placeholder="FOLDER",
        expectation="the path of a folder",
        also=(os.PathLike,),
    )
    scheduler: str | None = _declare(
        None,
        "--scheduler",
        "address of a running Dask scheduler, whose workers take the chunks of --max-memory and "
        "stay below it too, each",
        type=str,
        placeholder="ADDRESS",
        expectation="an address such as tcp://192.0.2.1:8786",
    )
    progress: bool | Callable[[float], None] = _declare(  # noqa: RUF009 (a field, as the others)
        False,
        "",
        "draw a progress bar on a terminal; or a function, which is called in any thread with the "
        "share of the work that is done, 0 to 1, and cancels by raising an error",
        also=(Callable,),
    )

    def __post_init__(self) -> None:
        if self.position_bits is None:
            object.__setattr__(self, "position_bits", AUTO)
        if self.step is not None and self.position_bits != AUTO:
            raise MeshletError(
                "step and position_bits both set the position step",
                "give one",
                options=("step", "position_bits"),
            )
        for option in OPTIONS:
            value = getattr(self, option.name)
            option.check(value)
            object.__setattr__(self, option.name, option.json_value(value))
        for name in ("fallback", "transport"):
            if self.memory and getattr(self, name):
                raise MeshletError(
                    f"{name} needs the whole model in memory",
                    "leave out max_memory",
                    options=(name, "max_memory"),
                )
        if self.scheduler is not None and not self.memory:
            raise MeshletError(
                "scheduler is for models larger than memory",
                "use max_memory too",
                options=("scheduler", "max_memory"),
            )
        if self.page_bytes is not None and 0 < self.page_bytes < MIN_PAGE_BYTES:
            raise MeshletError(
                f"page_bytes is {self.page_bytes}",
                f"use 0 or at least {MIN_PAGE_BYTES}",
                options=("page_bytes",),
            )

    @classmethod
    def of(cls, values: dict[str, Any]) -> Options:
        """Options from keyword arguments. Raises MeshletError for an unknown name too."""
        unknown = sorted(set(values) - {option.name for option in OPTIONS})
        if unknown:
            raise MeshletError(
                f"{unknown[0]} is not an option of compress", "see help(gltf_ext.compress)"
            )
        return cls(**values)

    @classmethod
    def json_values(cls, values: dict[str, Any]) -> dict[str, Any]:
        """Keyword arguments as values of JSON, without defaults. Raises MeshletError as `of`."""
        options = cls.of(values)
        return {
            name: None if value is None else getattr(options, name)
            for name, value in values.items()
        }

    @property
    def memory(self) -> int:
        """max_memory in bytes; 0 for no limit. Raises MeshletError for another text."""
        if self.max_memory is None:
            return 0
        try:
            return bytes_of(str(self.max_memory))
        except ValueError:
            raise MeshletError(
                f"max_memory is {self.max_memory!r}",
                f"use {MEMORY_TEXT}",
                options=("max_memory",),
            ) from None

    # --- the size of pages, in bytes ---

    @property
    def chooses_positions(self) -> bool:
        """Whether compress chooses the grids of positions."""
        return self.step is None and self.position_bits == AUTO

    @property
    def page_limit_with_levels(self) -> int:
        """Largest page of a primitive with levels of detail: they cannot be one blob.

        One that is built in several chunks keeps these pages if it cannot be simplified.
        """
        return self.page_bytes or DEFAULT_LOD_PAGE_BYTES

    def page_limit_without_levels(self, triangles: int, is_in_memory: bool) -> int:
        """Return the largest page of a primitive without levels; 0 for one blob.

        So are, with `lod`, primitives in one chunk that cannot be simplified. One that is not in
        memory may have several chunks, which cannot be one blob.
        """
        limit = self.page_bytes
        if limit is None:
            limit = DEFAULT_PAGE_BYTES if triangles > MOST_TRIANGLES_UNPAGED else 0
        return limit if is_in_memory else limit or DEFAULT_PAGE_BYTES

    @property
    def generation(self) -> dict[str, Any]:
        """Keyword arguments of _codec's encoders; they have their own default for lambda_."""
        shape = {} if self.lambda_ is None else {"lambda_": self.lambda_}
        return {"max_triangles": self.max_triangles, "effort": self.effort, **shape}


def _choices(name: str) -> tuple[str, ...]:
    """Return the values of an option whose type is a Literal; empty for others."""
    hint = get_type_hints(Options)[name]
    return get_args(hint) if get_origin(hint) is Literal else ()


OPTIONS: tuple[Option, ...] = tuple(
    dataclasses.replace(field.metadata["option"], name=field.name, choices=_choices(field.name))
    for field in dataclasses.fields(Options)
)
FLAGS = {option.name: option.flag for option in OPTIONS if option.flag}


def described() -> str:
    """Return the lines for the docstring of `compress`: each option by its Python name."""
    blocks = []
    for option in OPTIONS:
        choices = '" or "'.join(option.choices)
        text = f'"{choices}": {option.text}' if choices else option.text
        blocks.append(
            textwrap.fill(
                f"{option.name}: {text}.",
                100,
                initial_indent=" " * 8,
                subsequent_indent=" " * 12,
            )
        )
    return "\n".join(blocks) + "\n"
