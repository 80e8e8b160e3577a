"""The folders of the tests: described, and independent of one another."""

import re

from tests.helpers.environment import ROOT


def test_readme_of_the_tests_names_every_folder():
    table = (ROOT / "tests" / "README.md").read_text()
    named = set(re.findall(r"^\| `(\w+)/` \|", table, re.M))
    folders = {path.parent.name for path in (ROOT / "tests").glob("*/*.py")}
    assert named == folders


def test_no_test_imports_another_or_a_measurement():
    for path in (ROOT / "tests").glob("*/*.py"):
        imported = re.findall(
            r"^\s*(?:from|import) ((?:tests|bench)\b[\w.]*)", path.read_text(), re.M
        )
        for module in imported:
            allowed = (
                module.startswith("tests.helpers")
                or (path.parent.name == "bench" and module.startswith("bench"))
                or (path.parent.name == "hostile" and not path.name.startswith("test_"))
            )
            assert allowed, f"{path.relative_to(ROOT)} imports {module}"
