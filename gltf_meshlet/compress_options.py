"""The options of compress on the command line, from their one declaration."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from gltf_ext.options import OPTIONS, Option


def add(command: argparse.ArgumentParser, but: tuple[str, ...] = ()) -> None:
    """Adds all options but these. Those left out stay None: compress has the defaults."""
    for option in OPTIONS:
        if option.flag and option.name not in but:
            _add(command, option)


def values_of(options: argparse.Namespace) -> dict[str, Any]:
    """The options of compress that the command line names, for Python."""
    values = {o.name: getattr(options, o.name) for o in OPTIONS if o.flag}
    return {n: v for n, v in values.items() if v is not None and v is not False}


def _add(command: argparse.ArgumentParser, option: Option) -> None:
    help = option.text.replace("%", "%%")
    if option.type is bool:
        command.add_argument(option.flag, dest=option.name, action="store_true", help=help)
    elif option.choices:
        choices = "{" + ",".join(option.choices) + "}"  # compress checks them
        command.add_argument(option.flag, dest=option.name, metavar=choices, help=help)
    else:
        command.add_argument(
            option.flag, dest=option.name, type=_reader(option), metavar=option.metavar, help=help
        )


def _reader(option: Option) -> Callable[[str], Any]:
    """Return what reads the option's value; its name is for argparse's message."""

    def read(text: str) -> Any:
        return option.from_text(text)

    read.__name__ = f"{option.type.__name__} or auto" if option.automatic else option.type.__name__
    return read
