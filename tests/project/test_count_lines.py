"""tools/count_lines.py: what counts as product, as generated, and as neither."""

import json
import subprocess
import sys

from tests.helpers.environment import ROOT
from tools import count_lines


def test_files_count_in_their_row():
    counts = count_lines.counted(
        {
            "codec/a.cpp": b"1\n2\n",
            "codec/README.md": b"not source\n",
            "web/view/view.css": b"1\n",
            "web/wgsl/a.wgsl": b"1\n2\n3\n",
            "gltf_meshlet/view_page/view.js": b"1\n",
            "vk_backend/spirv/a.spv": bytes(1500),
            "tests/a.py": b"1\n",
            "setup.py": b"1\n",
        }
    )
    assert {name: count for name, count in counts.items() if count} == {
        "codec": 2,
        "web": 1,
        "product, written by hand": 3,
        "tests": 1,
        "generated: web/wgsl": 3,
        "generated: gltf_meshlet/view_page": 1,
        "generated: SPIR-V, kB": 2,
    }


def test_a_commit_is_compared_with_the_working_tree():
    def run(*arguments):
        command = (sys.executable, ROOT / "tools" / "count_lines.py", *arguments)
        return subprocess.run(command, capture_output=True, text=True)

    result = json.loads(run("--json", "--against", "HEAD").stdout)
    assert set(result) == {"before", "after"}
    assert result["before"].keys() == result["after"].keys()
    assert run("--against", "no-such-commit").returncode == 2
