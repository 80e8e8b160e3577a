"""Removes outputs whose models are gone."""

from __future__ import annotations

import contextlib
import json
import os
import posixpath
from collections.abc import Callable
from typing import Any

from gltf_ext.batches import task
from gltf_ext.batches.planning import Plan
from gltf_ext.batches.storage import STATE, Folder, folder_of


def gone_outputs(goal: Folder, plan: Plan) -> dict[str, list[str]]:
    """Return the name of a record -> names of outputs, of models that are gone.

    Only of those that are certain: the folder that held the model can be listed and is not empty,
    as that of a disk that is not mounted is; and nobody has changed the output since.
    """
    outputs: dict[str, list[str]] = {}
    for name in plan.remarks["leftover"]:
        record_name = task.record_name(name)
        with contextlib.suppress(Exception):  # no record, or what any storage raises
            record = json.loads(goal.read(record_name))
            if _is_gone(record) and all(
                task.holds(goal, file, output["digest"])
                for file, output in record["outputs"].items()
            ):
                outputs[record_name] = list(record["outputs"])
    return outputs


def _is_gone(record: dict[str, Any]) -> bool:
    """Return whether the model of a record is gone. Raises what its storage raises."""
    source, name = record["source"], record["name"]
    root = source[: -len(name)].rstrip("/") if source.endswith(f"/{name}") else ""
    if not root or root.endswith(":/"):  # of a list, whose names begin at the root
        root = posixpath.dirname(source)
    folder = Folder(root)
    if not (os.listdir(folder.url) if folder.is_local else folder.fs.ls(folder.path)):
        return False
    above, name = folder_of(source)
    try:
        if above.is_local:
            os.lstat(above.at(name))
        else:
            above.fs.invalidate_cache()
            above.fs.info(above.at(name))
    except (FileNotFoundError, NotADirectoryError):
        return True
    return False


def prune_outputs(
    goal: Folder, outputs: dict[str, list[str]], allowed: Callable[[list[str]], bool] | bool
) -> list[str]:
    """Remove outputs with their records, and folders that are empty then; returns their names.

    Args:
        goal: the destination.
        outputs: as gone_outputs gives them.
        allowed: whether to remove them, or what is asked with their names.

    Raises:
        OSError: a file cannot be removed.
    """
    names = sorted(name for files in outputs.values() for name in files)
    if not names or not (allowed is True or (callable(allowed) and allowed(names))):
        return []
    for record_name, files in outputs.items():
        for name in [*files, record_name]:
            if goal.exists(name):
                goal.fs.rm_file(goal.at(name))
            folder = posixpath.dirname(name)
            with contextlib.suppress(OSError):  # it is not empty
                while goal.is_local and folder not in ("", STATE):
                    os.rmdir(goal.at(folder))
                    folder = posixpath.dirname(folder)
    return names
