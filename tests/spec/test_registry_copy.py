"""The copies of the documents for glTF's registry."""

import json
import re

import pytest

from spec import registry_copy


def test_copies_have_the_prefix_and_no_dead_links():
    files = registry_copy.files("ACME")
    assert len(files) == 6
    for path, text in files.items():
        assert path.startswith("ACME_meshlet_") and not re.search(r"EXT\\?_meshlet", text)
        if path.endswith(".json"):
            assert json.loads(text)["$id"] == path.split("/")[-1]
            continue
        anchors = {
            re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-")
            for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)
        }
        for target in re.findall(r"\]\(([^)]+)\)", text):
            if target.startswith("#"):
                assert target[1:] in anchors
            elif "://" not in target:
                folder = path.split("/", maxsplit=1)[0]
                inside = f"{folder}/{target}".replace(f"{folder}/../", "")
                assert inside.split("#")[0] in files, target
        for word in ("docs/", "tests/", "CHANGELOG", "make_"):
            assert word not in text


@pytest.mark.parametrize("prefix", ["EXT", "KHR", "acme", "A_B", ""])
def test_other_prefixes_are_refused(prefix):
    with pytest.raises(ValueError, match="no vendor prefix"):
        registry_copy.files(prefix)
