"""Groups of a level are simplified up to one error; distances count by area."""

from __future__ import annotations

import numpy as np
import pytest

from gltf_ext import _codec
from gltf_ext.lod.errors import ErrorMeter
from gltf_ext.lod.reduction import HIGH, LAST_TRIES, TRIES, reduce_groups
from gltf_ext.lod.surface import Surface
from gltf_ext.lod.writing import _separate_points
from gltf_ext.ranges import begins_of
from tests.helpers import environment
from tests.helpers.gltf_builder import grid_mesh

SIDE, STEP = 24, 4.0


def surface_of(groups):
    """(surface of sheets side by side, a group of triangles for each)."""
    points, triangles = [], []
    sheet, corners = grid_mesh(SIDE, SIDE)
    for number in range(groups):
        triangles.append(corners + np.uint32(len(sheet) * number))
        points.append(SIDE * sheet + [2 * SIDE * number, 0, 0])
    points = np.concatenate(points).astype(np.float32)
    ids = np.arange(len(points), dtype=np.uint32)
    nothing = np.zeros((len(points), 0), np.float32)
    everything = np.concatenate(triangles)
    return Surface(
        everything, points, ids, ids, points, nothing, np.zeros(0, np.float32)
    ), triangles


@pytest.fixture(autouse=True)
def simplifier_package():
    environment.need_package("meshoptimizer")


class Meter:
    """error_of(group, attempt) stands for the measurement, lost_in for what it finds lost."""

    def __init__(self, groups, error_of, lost_in):
        self.attempts = np.zeros(groups, int)
        self.error_of, self.lost_in = error_of, lost_in

    def measure(self, after, groups):
        self.attempts[groups] += 1
        return np.array([self.error_of(g, self.attempts[g]) for g in groups])

    def lost_vertices(self, group, piece, max_distance):
        return np.array(self.lost_in.get(group, []), np.uint32)


def reduced(error_of, lost_in=None, expected=np.inf):
    """Simplifies eight groups."""
    surface, groups = surface_of(8)
    meter = Meter(len(groups), error_of, lost_in or {})
    after, error, _ = reduce_groups(surface, groups, STEP, meter, expected, threads=1)
    return groups, after, error, meter.attempts


def test_groups_near_the_median_are_simplified_once():
    groups, after, error, attempts = reduced(lambda g, _: 1.0 + g / 100)
    assert (attempts == 1).all()
    assert (error <= HIGH * np.median(error)).all()
    for before, now in zip(groups, after):
        assert 0 < len(now) <= len(before) / STEP + 1


def test_a_group_that_is_farther_is_tried_again():
    _, _, error, attempts = reduced(lambda g, n: 1.3 if g == 3 and n < 3 else 1.0)
    assert attempts[3] == 3
    assert error[3] == 1.0


def test_a_group_that_stays_farther_waits():
    groups, after, error, attempts = reduced(lambda g, _: 1.3 if g == 3 else 1.0)
    assert attempts[3] == 1 + TRIES + LAST_TRIES
    assert np.isinf(error[3])
    assert np.array_equal(after[3], groups[3])
    assert (np.delete(error, 3) == 1.0).all()


def test_a_group_that_comes_near_slowly_is_simplified():
    groups, after, error, attempts = reduced(lambda g, n: 1.3 if g == 3 and n <= TRIES + 1 else 1.0)
    assert attempts[3] == TRIES + 2
    assert error[3] == 1.0
    assert len(after[3]) < len(groups[3])


def test_what_a_group_lost_stays_at_the_next_try():
    middle = SIDE * (SIDE // 2) + SIDE // 2 + 3 * SIDE * SIDE
    lost = [middle, middle + 2, middle + 2 * SIDE]
    groups, after, _, attempts = reduced(lambda g, n: 9.0 if (g, n) == (3, 1) else 1.0, {3: lost})
    assert attempts[3] == 2
    assert np.isin(lost, after[3]).all()
    assert len(after[3]) <= len(groups[3]) / STEP + 1


def test_a_level_that_grows_too_much_is_tried_again():
    _, _, error, attempts = reduced(lambda _, n: 9.0 if n == 1 else 1.0, expected=2.0)
    assert (attempts == 2).all()
    assert (error == 1.0).all()


def test_a_level_may_have_the_error_that_lets_it_shrink():
    """Nothing is as near as expected, and nothing is simplified further than it must be."""
    _, after, error, _ = reduced(lambda _, n: 9.0 if n == 1 else 2.1, expected=1.0)
    assert (error == 2.1).all()
    assert max(map(len, after)) <= 2 * SIDE * SIDE / STEP


def test_a_level_that_must_grow_keeps_its_first_errors():
    _, after, error, attempts = reduced(lambda _, n: 8.0 + n, expected=2.0)
    assert (error == 8.0 + attempts).all()  # measured again at the end
    assert max(map(len, after)) <= 2 * SIDE * SIDE / STEP


def spiked(side):
    """(distance stated where a flat sheet replaces one with a spike at a vertex, its height)."""
    points, triangles = grid_mesh(side, side)
    points = side * points * [1, 1, 0]
    peak = len(points) // 2 + side // 2
    flat = np.concatenate([points, points]).astype(np.float32)
    flat[peak, 2] += 5.0
    after = (triangles + len(points)).astype(np.uint32)  # the flat copy
    meter = ErrorMeter([flat], triangles, begins_of([triangles]), np.arange(len(triangles)), 1)
    meter.begin_level(triangles, begins_of([triangles]), np.arange(len(triangles)))
    found = meter.measure([after], np.array([0]))
    return float(found[0]), 5.0


def test_a_spike_on_less_than_a_thousandth_of_the_area_does_not_count():
    assert spiked(160)[0] < 0.5


def test_a_spike_counts_where_samples_are_few():
    found, height = spiked(12)
    assert found == pytest.approx(height, rel=0.01)


def square(*holes):
    """Large triangles of a square of 1000 units, less strips of [begin, end) along x, and a grid of
    5,000 small ones beside it: (points, triangles)."""
    ends = [0, *np.ravel(holes), 1000]
    points, triangles = grid_mesh(50, 50)
    corners = [[[x, y, 0] for x in pair for y in (0, 1000)] for pair in zip(ends[::2], ends[1::2])]
    large = np.array([[0, 1, 2], [2, 1, 3]])
    parts = [points - [2, 0, 0], *np.array(corners, float)]
    firsts = np.cumsum([0, *map(len, parts)])[:-1]
    faces = [triangles, *(large for _ in corners)]
    return np.concatenate(parts), np.concatenate([f + n for f, n in zip(faces, firsts)])


@pytest.mark.parametrize("is_lost", [True, False])
def test_large_triangles_have_samples_by_their_area(is_lost):
    """One in a hundred of the area of few large triangles is lost, or there is too much of it."""
    parts = [square(), square((600, 610))]
    (points, before), (more, after) = parts if is_lost else parts[::-1]
    shape = np.concatenate([points, more]).astype(np.float32)
    before, after = before.astype(np.uint32), (after + len(points)).astype(np.uint32)
    meter = ErrorMeter([shape], before, begins_of([before]), np.arange(len(before)), 1)
    meter.begin_level(before, begins_of([before]), np.arange(len(before)))
    assert 4.0 < meter.measure([after], np.array([0]))[0] <= 5.0


def test_measuring_keeps_to_the_given_threads(monkeypatch):
    asked = []
    real = _codec.surface_distances

    def spied(points, positions, triangles, enough=0.0, threads=0):
        asked.append(threads)
        return real(points, positions, triangles, enough, threads)

    monkeypatch.setattr(_codec, "surface_distances", spied)
    surface, groups = surface_of(2)
    begin = np.array([0, *np.cumsum([len(group) for group in groups])])
    rows = np.arange(len(surface.triangles), dtype=np.uint32)
    meter = ErrorMeter([surface.points], surface.triangles, begin, rows, threads=1)
    meter.begin_level(surface.triangles, begin, rows)
    meter.lost_vertices(0, groups[0][:1], 0.5)
    assert asked == [1]


@pytest.mark.parametrize("first, is_parted", [(100, True), (1 << 23, False)])
def test_touching_surfaces_are_parted_where_floats_have_room(first, is_parted):
    """Two triangles that touch at a point; from 2^23 on, one float up is the next cell."""
    x = [first, first + 1, first, first, first - 1, first]
    points = np.array([x, [0, 0, 1, 0, 0, -1], [0] * 6], np.float32).T.copy()
    same_position = np.uint32([0, 1, 2, 0, 3, 4])
    numbers = np.arange(6, dtype=np.uint32)
    triangles = numbers.reshape(2, 3)
    apart = _separate_points(points, same_position, numbers, triangles, numbers)
    assert (len(np.unique(apart, axis=0)) == 6) == is_parted
    assert np.abs(apart - points).max() < 0.5
