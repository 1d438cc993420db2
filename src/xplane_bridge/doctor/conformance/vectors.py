"""The little of vectors and statistics that the questions need."""

from __future__ import annotations

import math
from typing import Sequence, Tuple

from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.link import Sample

Vector = Tuple[float, float, float]


def rms(values: Sequence[float]) -> float:
    """Root of the mean of squares; 0 of nothing."""
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else 0.0


def median(values: Sequence[float]) -> float:
    """The value in the middle."""
    return sorted(values)[len(values) // 2]


def turn(a: float, b: float) -> float:
    """From b to a, -180..180 [deg]."""
    return (a - b + 180.0) % 360.0 - 180.0


def body_axes(sample: Sample) -> Tuple[Vector, Vector, Vector]:
    """Nose, right wing and floor of the aircraft in east, up, south at the scenery's origin."""
    pitch, roll, heading = (math.radians(sample[path]) for path in names.ORIGIN_ANGLES)
    nose = (math.cos(pitch) * math.sin(heading), math.sin(pitch), -math.cos(pitch) * math.cos(heading))
    level_right = (math.cos(heading), 0.0, math.sin(heading))
    level_floor = (
        math.sin(pitch) * math.sin(heading),
        -math.cos(pitch),
        -math.sin(pitch) * math.cos(heading),
    )
    right = _sum(level_right, math.cos(roll), level_floor, math.sin(roll))
    floor = _sum(level_floor, math.cos(roll), level_right, -math.sin(roll))
    return nose, right, floor


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Scalar product."""
    return sum(x * y for x, y in zip(a, b))


def length(a: Sequence[float]) -> float:
    """Euclidean norm."""
    return math.sqrt(dot(a, a))


def _sum(a: Vector, scale_a: float, b: Vector, scale_b: float) -> Vector:
    x, y, z = (p * scale_a + q * scale_b for p, q in zip(a, b))
    return x, y, z
