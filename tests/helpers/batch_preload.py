"""Loaded by workers (distributed.worker.preload): tasks leave a trace, wait, or kill their worker.

BATCH_LOG names a file that gets a line "PID NAME" as each file is about to be compressed. A name
that holds "killer" kills the worker with SIGKILL, one with "stopper" stops it with SIGSTOP, one
with "sleeper" takes an hour. BATCH_WAIT: seconds that each file takes longer. BATCH_VERSION: the
version of the package that this program claims to have, "none" for none.
"""

import importlib.metadata
import os
import signal
import time

from gltf_ext.batches import task
from gltf_ext.commands.compress import compress


def traced(input, output, **options):
    with open(os.environ["BATCH_LOG"], "a") as log:
        log.write(f"{os.getpid()} {os.path.basename(input)}\n")
    if "killer" in os.path.basename(input):
        os.kill(os.getpid(), signal.SIGKILL)
    if "stopper" in os.path.basename(input):
        os.kill(os.getpid(), signal.SIGSTOP)
    if "sleeper" in os.path.basename(input):
        time.sleep(3600)
    time.sleep(float(os.environ.get("BATCH_WAIT", 0)))
    return compress(input, output, **options)


task.compress = traced


def claimed(name):
    if os.environ["BATCH_VERSION"] == "none":
        raise importlib.metadata.PackageNotFoundError(name)
    return os.environ["BATCH_VERSION"]


if "BATCH_VERSION" in os.environ:
    importlib.metadata.version = claimed
