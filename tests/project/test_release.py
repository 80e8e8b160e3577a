"""tools/release.py: versions, notes and the owner, in a copy of the project's files."""

import re
import shutil
import subprocess

import pytest

from tests.helpers.environment import ROOT
from tools import release, try_wheel

DATE = "2031-02-03"


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A repository with the files that a release changes, and an entry in CHANGELOG.md."""
    names = [path.relative_to(ROOT) for path in release.files_with_owner()]
    for name in {*map(str, names), *release.VERSIONS, release.CHANGELOG}:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for command in (("init", "-q"), ("add", "-A")):
        subprocess.run(("git", *command), cwd=tmp_path, check=True)
    monkeypatch.setattr(release, "ROOT", tmp_path)
    return tmp_path


def test_a_release_from_start_to_end(project, capsys):
    """Every step of docs/releasing.md; check names what the next step mends."""
    problems = release.check("v9.8.7")
    assert len(problems) == len(release.VERSIONS) + 1 + len(release.files_with_owner())
    assert all("\n" not in line for line in problems)
    assert release.main(["owner", "some-group"]) == 0
    release.prepare("9.8.7", DATE)
    assert release.check("v9.8.7") == []
    assert release.main(["check", "v9.8.7"]) == 0
    assert release.main(["check", "v9.8.8"]) == 1
    assert release.main(["check", "9.8.7"]) == 1
    texts = {name: (project / name).read_text() for name in release.VERSIONS}
    assert f"date-released: {DATE}\n" in texts["CITATION.cff"]
    assert "github.com/some-group/gltf-meshlet" in texts["web/package.json"]
    assert "some-group.github.io/gltf-meshlet" in (project / "pyproject.toml").read_text()
    capsys.readouterr()
    assert release.main(["notes"]) == 0
    notes = capsys.readouterr().out
    assert notes.startswith("9.8.7, bitstream version ") and "\n### Added\n" in notes
    assert "\n## " not in notes
    assert release.main(["next", "9.9.0.dev0"]) == 0
    assert (project / "CHANGELOG.md").read_text().count("## [Unreleased]") == 1
    assert '"version": "9.9.0-dev.0"' in (project / "web" / "package.json").read_text()
    assert release.main(["check", "v9.9.0"]) == 1


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["owner", "../somebody"], "no name of an account"),
        (["prepare", "0.2"], "no version such as"),
        (["prepare", "0.2.0.dev1"], "no version such as"),
        (["next", "0.3.0"], "no version such as"),
        (["next", "0.3.0.dev0"], "already"),
        (["notes"], "no section"),
    ],
)
def test_a_step_that_cannot_be_done_is_one_line(arguments, reason, project, capsys):
    before = {path: path.read_bytes() for path in project.rglob("*.*") if path.is_file()}
    assert release.main(arguments) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("release.py: ") and reason in line
    assert before == {path: path.read_bytes() for path in before}


def test_without_an_entry_nothing_is_released(project, capsys):
    (project / "CHANGELOG.md").write_text("# Changelog\n\n## [Unreleased]\n\n0.2.0.dev0.\n")
    assert release.main(["prepare", "0.2.0"]) == 1
    assert "has no entry for 0.2.0" in capsys.readouterr().err


def test_all_files_say_the_same_version():
    version = release.current_version()
    for name, (_, wording) in release.VERSIONS.items():
        assert release.version_in(name) == wording(version), name


def test_every_placeholder_is_in_an_address_that_is_filled_in():
    command = ("git", "grep", "-nwE", release.OWNER, "--", ".", ":!tools", ":!tests")
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout.splitlines()
    assert lines
    for line in lines:
        rest = re.sub(r"\bOWNER(\.github\.io)?/gltf-meshlet", "", line)
        assert "OWNER" not in rest or line.startswith(("docs/releasing.md", "pyproject.toml")), line


def test_readme_s_commands_are_found():
    readme = (ROOT / "README.md").read_text()
    commands = try_wheel.commands(readme)
    assert commands[0][:2] == ["pip", "install"]
    assert {words[0] for words in commands[1:]} == {"gltf-meshlet"}
    assert not any("#" in word for words in commands for word in words)
    assert "import gltf_ext" in try_wheel.python_block(readme)
