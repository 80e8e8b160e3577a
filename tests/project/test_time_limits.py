"""Tests end, and so do the programs that they start."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.environment import ROOT
from tests.helpers.processes import running

SLEEP = [sys.executable, "-c", "import time; print('started', flush=True); time.sleep(600)"]


def is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def run_test(folder: Path, body: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Runs a test with the project's settings."""
    (folder / "test_it.py").write_text(body)
    settings = ("-c", ROOT / "pyproject.toml", "--rootdir", folder, "-p", "no:cacheprovider")
    command = [sys.executable, "-m", "pytest", *settings, *options, folder / "test_it.py"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder)


def test_every_test_has_a_limit(request):
    assert float(request.config.getini("timeout")) == 900


@pytest.mark.full
def test_full_tests_have_a_longer_limit(request):
    assert request.node.get_closest_marker("timeout").args == (3600,)


def test_a_test_that_hangs_fails_and_its_program_is_killed(tmp_path):
    body = f"""
from tests.helpers.processes import running

def test_hangs():
    with running({SLEEP!r}) as process:
        open("pid", "w").write(str(process.pid))
        process.wait()
"""
    result = run_test(tmp_path, body, "-o", "timeout=2")
    assert result.returncode == 1 and "Timeout" in result.stdout, result.stdout
    assert not is_alive(int((tmp_path / "pid").read_text()))


def test_a_test_that_handles_no_signals_ends(tmp_path):
    """As one that hangs in C code: a second limit ends its process."""
    body = """
import signal, time

def test_hangs():
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])
    time.sleep(600)
"""
    result = run_test(tmp_path, body, "-o", "timeout=1", "-o", "faulthandler_timeout=3")
    assert result.returncode == 1 and "Timeout" in result.stderr, result.stderr


def test_programsanswer_interrupts_of_tests_in_the_background():
    """A shell starts `make test &` with SIGINT ignored, which children inherit."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with running(SLEEP, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout.readline() == b"started\n"
            process.send_signal(signal.SIGINT)
            assert b"KeyboardInterrupt" in process.communicate(timeout=60)[1]
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_program_that_goes_on_is_killed():
    with pytest.raises(subprocess.TimeoutExpired), running(SLEEP, ends=0.2) as process:
        pass
    assert process.returncode == -signal.SIGKILL


def test_tests_start_programs_that_end():
    """With `running`, or with subprocess.run, which kills them when the test's limit is over."""
    own = {
        "tests/helpers/processes.py",
        "tests/helpers/on_windows.py",  # runs in Wine, without the other helpers; kills its own
        "tests/batches/conftest.py",
        "tests/project/test_time_limits.py",
    }
    starting = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "tests").rglob("*.py")
        if re.search(r"\bPopen\(|os\.spawn|os\.fork\(", path.read_text())
    }
    assert starting <= own
