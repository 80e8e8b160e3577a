"""Mutated glTF files through every command; see fuzz.py. `make fuzz` runs many more."""

import subprocess
import sys

from tests.helpers import environment

MUTANTS, EACH = 2_000, 3
SEED = 25
MINUTES = 15  # on a busy machine; half a minute otherwise


def test_mutants_are_refused_or_harmless():
    """In a process of its own, which a crash of native code may end."""
    command = [sys.executable, "-m", "tests.hostile.fuzz", str(MUTANTS), "--each", str(EACH)]
    done = subprocess.run(
        [*command, "--seed", str(SEED)],
        cwd=environment.ROOT,
        capture_output=True,
        text=True,
        timeout=60 * MINUTES,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    print(done.stdout)
    if "without" in done.stdout:
        environment.missing(done.stdout.splitlines()[0])
