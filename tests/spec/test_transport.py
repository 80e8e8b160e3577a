"""EXT_meshlet_transport: vectors, the C++ and the reference unpacker, damaged pages."""

import json
import random

import pytest

from gltf_ext import _codec
from spec import make_transport_vectors, reference_transport
from spec.make_transport_vectors import FOLDER
from tests.helpers.environment import ROOT

VALID = sorted(FOLDER.glob("valid_*.bin"))
MALFORMED = json.loads((FOLDER / "malformed.json").read_text())
SMALL = [path for path in VALID if path.stat().st_size < 600]


def answer(unpack, packed):
    """The resident bytes; None if they are refused with one line."""
    try:
        return unpack(packed)
    except ValueError as error:
        assert str(error) and "\n" not in str(error)
        return None


def test_vectors_are_current():
    written = make_transport_vectors.files()
    assert written == {path.name: path.read_bytes() for path in FOLDER.iterdir()}


@pytest.mark.parametrize("path", VALID, ids=lambda path: path.stem)
def test_unpackers_agree(path):
    packed, resident = path.read_bytes(), path.with_suffix(".resident").read_bytes()
    assert _codec.unpack(packed) == resident
    assert reference_transport.unpack_view(packed) == resident
    assert _codec.pack(resident, threads=2) == packed


def test_vectors_use_every_setting():
    settings = set()
    for path in VALID:
        for packed, size in reference_transport.page_table(path.read_bytes()):
            if len(packed) != size:
                bits = reference_transport.PageReader(packed).bits(3)
                settings |= {i for i in range(3) if bits >> i & 1}
    assert settings == {0, 1, 2}


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed_views_are_refused(name):
    packed = (FOLDER / name).read_bytes()
    with pytest.raises(ValueError, match=r"^[^\n]+$"):
        _codec.unpack(packed)
    assert make_transport_vectors.refusal(packed) == MALFORMED[name]


def test_unpackers_agree_on_damaged_pages():
    rng = random.Random(31)
    unpacked = 0
    for _ in range(120):
        packed = bytearray(rng.choice(SMALL).read_bytes())
        for _ in range(rng.choice((1, 1, 3))):
            packed[rng.randrange(len(packed))] ^= 1 << rng.randrange(8)
        results = [
            answer(unpack, bytes(packed))
            for unpack in (_codec.unpack, reference_transport.unpack_view)
        ]
        assert results[0] == results[1]
        unpacked += results[0] is not None
    assert unpacked < 60


def test_blobs_in_any_form_come_back():
    """Random codes, widths and masks are no canonical form: such pages are raw."""
    for path in (ROOT / "spec/vectors").glob("v*.bin"):
        view = path.read_bytes()
        assert _codec.unpack(_codec.pack(view)) == view


def test_packing_refuses_malformed_views():
    blob = (ROOT / "spec/vectors/malformed_inconsistent.bin").read_bytes()
    with pytest.raises(ValueError, match="vertex"):
        _codec.pack(blob)
