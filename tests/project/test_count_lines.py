"""tools/count_lines.py: what counts as product, as generated, and as neither."""

import json
import subprocess
import sys

from tests.helpers.environment import ROOT
from tools import count_lines

TOTALS = ("product, written by hand", "generated: SPIR-V, kB")
NOT_PYTHON = ("codec", "shaders", "web", "blender")
PYPROJECT = {"pyproject.toml": b'[tool.scikit-build]\nwheel.packages = ["gltf_ext"]\n'}


def test_files_count_in_their_row():
    files = {
        **PYPROJECT,
        "codec/a.cpp": b"1\n2\n",
        "codec/README.md": b"not source\n",
        "web/view/view.css": b"1\n",
        "web/wgsl/a.wgsl": b"1\n2\n3\n",
        "gltf_meshlet/view_page/view.js": b"1\n",
        "vk_backend/spirv/a.spv": bytes(1500),
        "tests/a.py": b"1\n",
        "setup.py": b"1\n",
    }
    counts = count_lines.counted({"lines": files})["lines"]
    assert {name: count for name, count in counts.items() if count} == {
        "codec": 2,
        "web": 1,
        "product, written by hand": 3,
        "tests": 1,
        "generated: web/wgsl": 3,
        "generated: gltf_meshlet/view_page": 1,
        "generated: SPIR-V, kB": 2,
    }


def test_a_new_package_of_the_wheel_counts_as_product_of_both_trees():
    text = b'wheel.packages = [\n  "gltf_ext",\n  "new_one",\n]\n'
    before = {**PYPROJECT, "gltf_ext/a.py": b"1\n2\n3\n"}
    after = {"pyproject.toml": text, "gltf_ext/a.py": b"1\n", "new_one/b.py": b"2\n3\n"}
    counts = count_lines.counted({"before": before, "after": after})
    assert counts["before"]["new_one"] == 0 and counts["after"]["new_one"] == 2
    assert counts["before"]["product, written by hand"] == 3
    assert counts["after"]["product, written by hand"] == 3


def test_every_source_of_every_folder_is_counted():
    files = count_lines.working_tree()
    counts = count_lines.counted({"lines": files})["lines"]
    lines = sum(
        content.count(b"\n")
        for name, content in files.items()
        if "/" in name and name.endswith((".wgsl", *count_lines.SUFFIXES))
    )
    rows = {name: n for name, n in counts.items() if name not in TOTALS}
    assert sum(rows.values()) == lines
    product = sum(counts[name] for name in (*count_lines.wheel_packages(files), *NOT_PYTHON))
    assert counts["product, written by hand"] == product


def test_a_commit_is_compared_with_the_working_tree():
    def run(*arguments):
        command = (sys.executable, ROOT / "tools" / "count_lines.py", *arguments)
        return subprocess.run(command, capture_output=True, text=True)

    result = json.loads(run("--json", "--against", "HEAD").stdout)
    assert set(result) == {"before", "after"}
    assert result["before"].keys() == result["after"].keys()
    assert run("--against", "no-such-commit").returncode == 2
