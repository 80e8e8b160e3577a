"""Waits for programs on this machine: schedulers and workers of Dask, commands that use them."""

import socket
import time

PATIENCE = 120  # seconds for anything to happen on a busy machine


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def is_open(port):
    """Whether a program listens there."""
    with socket.socket() as sock:
        return sock.connect_ex(("127.0.0.1", port)) == 0


def eventually(condition, patience=PATIENCE, process=None, every=0.05):
    """process: it must be running until then. every: seconds."""
    deadline = time.monotonic() + patience
    while not (result := condition()):
        assert time.monotonic() < deadline
        assert process is None or process.poll() is None, process.communicate()
        time.sleep(every)
    return result


def finished(process, status, patience=PATIENCE):
    out, error = process.communicate(timeout=patience)
    assert process.returncode == status, error
    return out, error
