"""Errors of the values of one attribute, as distances and as shares of what its bits allow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from gltf_ext._codec import Stream
from gltf_ext.attributes.ranges import Limit
from gltf_ext.attributes.streams import GRID, OCT, SIGN, WEIGHT_SUM_TOLERANCE, octahedral_bound
from gltf_ext.sources.attribute_names import semantic

OF_AREA = 0.999  # share of the area whose largest error is measured
# Rounding of positions to float32, and of half a step in float64, relative to the value.
FLOAT_ROUNDING = 2.0**-23
STEP_ROUNDING = 1.0 + 1e-6


@dataclass
class Errors:
    """Errors of one attribute of one primitive.

    Attributes:
        max, squares, count: largest distance, sum of squared distances, number of vertices.
        largest_component: largest difference of a component, of values on grids.
        over_bound: largest error as a fraction of the allowed one.
        degrees: largest angle; None unless it is a direction.
        box: float64[2, components]: the original's smallest and largest values; None if the
            attribute was not compared, because the primitives differ.
        is_compared: whether there was a vertex to compare.
        distances: of each vertex, float32[n], part after part.
        of_area: the error that OF_AREA of the triangles' area stays within; None if not measured.
        limit: what the bits promise to the eye; None where half a step is all there is to say.
    """

    max: float = 0.0
    squares: float = 0.0
    count: int = 0
    largest_component: float = 0.0
    over_bound: float = 0.0
    degrees: float | None = None
    box: np.ndarray | None = None
    is_compared: bool = False
    distances: list[np.ndarray] = field(default_factory=list)
    of_area: float | None = None
    limit: Limit | None = None

    def join(self, other: Errors) -> None:
        """Add the errors of other vertices."""
        self.max, self.over_bound = max(self.max, other.max), max(self.over_bound, other.over_bound)
        self.largest_component = max(self.largest_component, other.largest_component)
        self.squares, self.count = self.squares + other.squares, self.count + other.count
        if other.degrees is not None:
            self.degrees = max(self.degrees or 0.0, other.degrees)
        boxes = [box for box in (self.box, other.box) if box is not None]
        self.box = np.stack([np.min(boxes, axis=(0, 1)), np.max(boxes, axis=(0, 1))])
        self.is_compared |= other.is_compared
        self.distances += other.distances

    def measure_area(self, rows: np.ndarray, corners: np.ndarray, areas: np.ndarray) -> None:
        """Set of_area: a triangle's error is that of its worst corner.

        Args:
            rows: of the vertices whose distances are there.
            corners: [T, 3]: rows at the corners of triangles.
            areas: float64[T].
        """
        distances = np.concatenate([np.zeros(0, np.float32), *self.distances])
        self.distances = []
        if len(distances) != len(rows) or not areas.sum() > 0.0:
            return
        of_row = np.zeros(int(corners.max()) + 1, np.float32)
        of_row[rows] = distances
        worst = of_row[corners].max(axis=1)
        order = np.argsort(worst)
        sums = np.cumsum(areas[order])
        self.of_area = float(worst[order[np.searchsorted(sums, OF_AREA * sums[-1])]])

    def add(self, distances: np.ndarray, over_bound: float) -> None:
        """Add distances of vertices, [n], and their largest error as a fraction of the bound."""
        if len(distances):
            self.max = max(self.max, float(distances.max()))
        self.squares += float(np.square(distances).sum())
        self.count += len(distances)
        self.over_bound = max(self.over_bound, over_bound)


def errors_of(
    name: str, values: np.ndarray, decoded_values: np.ndarray, streams: list[Stream]
) -> Errors:
    """Return errors of one attribute of vertices, [n, components] before and after."""
    source, result = values.astype(np.float64), decoded_values.astype(np.float64)
    box = np.array([values.min(axis=0), values.max(axis=0)], np.float64)
    errors = Errors(box=box, is_compared=True)
    start = 0
    for stream in streams:
        columns = slice(start, start + stream.width)
        start += stream.width
        if stream.kind == OCT:
            _add_directions(errors, source[:, columns], result[:, columns], stream)
        elif stream.kind == SIGN:
            is_equal = (source[:, columns] >= 0.0) == (result[:, columns] > 0.0)
            errors.add(np.empty(0), 0.0 if is_equal.all() else math.inf)
        elif stream.kind == GRID:
            _add_grid(errors, source[:, columns], result[:, columns], stream, name)
        else:
            with np.errstate(invalid="ignore"):  # of two infinite values
                distances = np.nan_to_num(
                    np.abs(source[:, columns] - result[:, columns]).max(axis=1)
                )
            errors.add(distances, math.inf if distances.any() else 0.0)
    errors.distances.append(_distances(source, result, streams[0].kind == OCT))
    return errors


def _distances(source: np.ndarray, result: np.ndarray, is_direction: bool) -> np.ndarray:
    """Return float32[n]: of each vertex, in units of Errors.max."""
    if is_direction:
        source, result = source[:, :3], result[:, :3]
        length = np.linalg.norm(source, axis=1, keepdims=True)
        source = np.where(length > 0.0, source / np.where(length > 0.0, length, 1.0), result)
    with np.errstate(invalid="ignore"):  # of two infinite values
        lengths = np.nan_to_num(np.linalg.norm(source - result, axis=1))
    distances: np.ndarray = lengths.astype(np.float32)
    return distances


def _add_grid(
    errors: Errors, source: np.ndarray, result: np.ndarray, stream: Stream, name: str
) -> None:
    difference = np.abs(source - result)
    errors.largest_component = max(errors.largest_component, float(difference.max(initial=0.0)))
    magnitude = np.maximum(np.abs(source).max(axis=0), np.abs(stream.offset))
    if semantic(name) == "WEIGHTS":
        # Rounded up or down so that the sum stays, after the sum is scaled to one.
        max_difference = stream.step + WEIGHT_SUM_TOLERANCE
    else:
        max_difference = 0.5 * stream.step * STEP_ROUNDING
    over_bound = (difference / (max_difference + FLOAT_ROUNDING * magnitude)).max()
    errors.add(np.sqrt((difference * difference).sum(axis=1)), float(over_bound))


def _add_directions(errors: Errors, source: np.ndarray, result: np.ndarray, stream: Stream) -> None:
    """Add distances of unit vectors, except from source vectors of length zero."""
    length = np.linalg.norm(source, axis=1)
    usable = length > 0.0
    if usable.any():
        distances = np.linalg.norm(source[usable] / length[usable, None] - result[usable], axis=1)
        angle = 2.0 * math.asin(min(float(distances.max()) / 2.0, 1.0))
        errors.degrees = math.degrees(angle)
        errors.add(distances, angle / (octahedral_bound(stream.bits) + FLOAT_ROUNDING))
