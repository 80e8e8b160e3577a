"""Runs a function in a process of its own, which may crash or hang."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from gltf_ext.errors import MeshletError

from ..gpu import vk


@dataclass(frozen=True)
class Failure:
    """Why a function gave no result."""

    why: str


def run_apart(function: Callable[[Any], Any], argument: Any, seconds: float) -> Any:
    """The function's result, or Failure if it fails, crashes or takes longer."""
    context = multiprocessing.get_context("spawn")  # a fork would share the driver's state
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(sending, function, argument), daemon=True)
    process.start()
    sending.close()
    try:
        if not receiving.poll(seconds):
            return Failure(f"no answer within {seconds:g} seconds")
        return receiving.recv()
    except EOFError:
        process.join()
        return Failure(f"the driver crashed the process ({_status(process.exitcode)})")
    finally:
        process.kill()
        process.join()
        receiving.close()


def _status(code: int | None) -> str:
    return f"signal {-code}" if code is not None and code < 0 else f"exit status {code}"


def _run(sending: Connection, function: Callable[[Any], Any], argument: Any) -> None:
    sending.send(caught(function, argument))
    sending.close()


def caught(function: Callable[[Any], Any], argument: Any) -> Any:
    """The function's result, or Failure."""
    try:
        return function(argument)
    except MeshletError as error:
        return Failure(error.message)
    except vk.VkError as error:
        return Failure(f"the driver refused: {type(error).__name__}")
    except MemoryError:
        return Failure("there is not enough memory")
