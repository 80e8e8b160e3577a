"""tools/system_packages.py as root, with a program in place of apt-get."""

import pytest

from tools import system_packages
from tools.system_packages import DRIVER, VARIABLE

MIRROR = "http://mirror.example/debian"


@pytest.fixture
def machine(tmp_path, monkeypatch, capsys):
    """machine(missing, wish, releases): runs it on a bookworm; returns (lines, calls of apt-get,
    text of the added source during the calls)."""
    log, sources = tmp_path / "log", tmp_path / "added.list"
    targets = tmp_path / "targets"
    fake = tmp_path / "bin" / "apt-get"
    fake.parent.mkdir()
    fake.write_text(
        f'#!/bin/sh\nif [ "$1" = indextargets ]; then exec cat {targets}; fi\n'
        f'echo "$*" >> {log}\nif [ -e {sources} ]; then cat {sources} >> {tmp_path}/seen; fi\n'
    )
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{fake.parent}:/usr/bin:/bin")
    monkeypatch.setattr("os.geteuid", lambda: 0)
    monkeypatch.setattr("sys.argv", ["system_packages.py"])
    monkeypatch.setattr(system_packages, "SOURCES", sources)
    monkeypatch.setattr(system_packages, "codename", lambda: "bookworm")

    def run(missing, wish, releases=("bookworm",)):
        targets.write_text("".join(f"{release} {MIRROR}\n" for release in releases))
        monkeypatch.setattr(system_packages, "missing", lambda: missing)
        monkeypatch.delenv(VARIABLE, raising=False)
        if wish is not None:
            monkeypatch.setenv(VARIABLE, wish)
        system_packages.main()
        assert not sources.exists()
        calls = log.read_text().splitlines() if log.exists() else []
        seen = tmp_path / "seen"
        added = seen.read_text() if seen.exists() else ""
        return capsys.readouterr().out.splitlines(), calls, added

    return run


@pytest.mark.parametrize("wish", [None, "", "yes"])
def test_says_what_comes_from_where_and_how_to_decline(machine, wish):
    lines, calls, added = machine(["libllvm19", "spirv-tools"], wish)
    assert lines == [
        f"make: installing libllvm19 spirv-tools from {MIRROR}; to decline, set {VARIABLE}=no"
    ]
    assert calls[0].endswith(" update")
    assert calls[-1].endswith(" install libllvm19 spirv-tools") and added == ""


@pytest.mark.parametrize("wish", [None, ""])
def test_adds_no_source_unasked(machine, wish):
    lines, calls, added = machine(["libllvm19", DRIVER], wish)
    skipped, installing = lines
    assert DRIVER in skipped and "bookworm-backports" in skipped and "are skipped" in skipped
    assert skipped.endswith(f"{VARIABLE}=yes .venv/bin/python tools/system_packages.py")
    assert installing.startswith(f"make: installing libllvm19 from {MIRROR}; ")
    assert not any(DRIVER in call for call in calls) and added == ""


def test_installs_nothing_if_only_the_source_is_missing(machine):
    lines, calls, added = machine([DRIVER], None)
    assert len(lines) == 1 and calls == [] and added == ""


def test_adds_the_source_if_asked(machine):
    lines, calls, added = machine(["libllvm19", DRIVER], "yes")
    (line,) = lines
    assert f"{MIRROR} bookworm-backports main" in line and f"set {VARIABLE}=no" in line
    assert calls[-1].endswith(f" install -t bookworm-backports {DRIVER}")
    assert f"{MIRROR} bookworm-backports main\n" in added


def test_uses_a_source_that_is_there(machine):
    lines, calls, added = machine([DRIVER], None, ("bookworm", "bookworm-backports"))
    assert len(lines) == 1 and "installing" in lines[0]
    assert calls[-1].endswith(f" install -t bookworm-backports {DRIVER}") and added == ""


@pytest.mark.parametrize(("wish", "count"), [("no", 1), ("off", 2)])
def test_declined(machine, wish, count):
    lines, calls, added = machine(["libllvm19", DRIVER], wish)
    assert len(lines) == count and lines[-1].endswith(f"apt install libllvm19 {DRIVER}")
    assert calls == [] and added == ""
