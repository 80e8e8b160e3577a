"""The choice of resident pages, without a device."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gltf_ext.errors import MeshletError

PAGES, ROOTS = 60, 2


def hierarchy(random):
    """Pages that need one to three coarser ones, which have smaller numbers."""
    coarser = [
        sorted(set(random.integers(0, max(page * 2 // 3, 1), random.integers(1, 4))))
        for page in range(PAGES)
    ]
    depth = np.zeros(PAGES, int)
    for page in range(ROOTS, PAGES):
        depth[page] = 1 + depth[coarser[page]].max()
    pairs = np.array([(p, c) for p in range(ROOTS, PAGES) for c in coarser[p]])
    layers = [pairs[depth[pairs[:, 0]] == d].T for d in range(1, depth.max() + 1)]
    return SimpleNamespace(is_root=np.arange(PAGES) < ROOTS, coarser=[tuple(a) for a in layers])


def blob(page):
    return b"%d" % page


@pytest.mark.parametrize("failing", [0.0, 0.2])
@pytest.mark.parametrize("slots", [0, 1, 7, 25, PAGES])
def test_pages_have_all_that_they_need(slots, failing):
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.levels.residency import NOT_RESIDENT, Residency

    random = np.random.default_rng(slots)
    found = hierarchy(random)
    bad = set(np.flatnonzero(random.random(PAGES) < failing))

    def read(page):
        if page in bad:
            raise MeshletError("damaged")
        return blob(page)

    residency = Residency(found, slots, read)
    shadow = {page: page for page in range(ROOTS)}  # page -> row, from the updates alone
    for _ in range(60):
        pixels = np.where(random.random(PAGES) < 0.4, random.random(PAGES), 0).astype(np.float32)
        for _ in range(PAGES):
            update = residency.update(pixels, 5)
            for page in update.evicted:
                del shadow[page]
            for page, row, content in update.loads:
                assert content == blob(page) and row not in shadow.values()
                shadow[page] = row
            assert len(update.loads) <= 5 and len(shadow) <= ROOTS + slots
            for finer, coarser in found.coarser:
                assert all(c in shadow for f, c in zip(finer, coarser) if f in shadow)
            rows = np.full(PAGES, NOT_RESIDENT)
            rows[list(shadow)] = list(shadow.values())
            assert (residency.rows == rows).all()
            if not update.loads:
                break
        assert not update.loads, "the same requests end in the same pages"
        # Whatever is needed beyond the allowed error is there, unless it cannot be read.
        lost = np.isin(np.arange(PAGES), list(bad))
        for finer, coarser in found.coarser:
            np.logical_or.at(lost, finer, lost[coarser])
        needed = (pixels > update.pixels) & ~lost
        assert set(np.flatnonzero(needed)) <= set(shadow)


def test_recently_used_pages_stay():
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.levels.residency import NOT_RESIDENT, Residency

    found = SimpleNamespace(is_root=np.arange(6) < 1, coarser=[])
    residency = Residency(found, 3, blob)

    def want(*pages):
        pixels = np.zeros(6, np.float32)
        pixels[list(pages)] = 1
        return [page for page, *_ in residency.update(pixels, 9).loads]

    assert want(1) == [1] and want(2) == [2] and want(3) == [3]
    assert want(1) == []
    assert want(4) == [4]  # in place of 2, the longest unused
    assert np.flatnonzero(residency.rows != NOT_RESIDENT).tolist() == [0, 1, 3, 4]


def test_what_is_needed_later_comes_last_and_raises_no_error():
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.levels.residency import Residency

    found = SimpleNamespace(is_root=np.arange(7) < 1, coarser=[])
    residency = Residency(found, 3, blob)

    def update(now, ahead):
        pixels, later = np.zeros((2, 7), np.float32)
        for wanted, errors in ((pixels, now), (later, ahead)):
            wanted[list(errors)] = list(errors.values())
        return residency.update(pixels, 9, later)

    found = update({1: 1.0, 2: 2.0}, {1: 9.0, 3: 7.0, 4: 8.0})
    assert [page for page, *_ in found.loads] == [2, 1, 4] and found.pixels == 0
    # Page 4 was wanted where the camera went; now it is there, and the longest unused page goes.
    assert not update({4: 8.0, 2: 2.0}, {}).loads
    found = update({3: 7.0, 4: 8.0, 5: 5.0, 6: 4.0}, {1: 9.0})
    assert [page for page, *_ in found.loads] == [3, 5] and found.pixels == 4.0
