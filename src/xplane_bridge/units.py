"""X-Plane's Earth, and what turns the units that X-Plane, JSBSim and airport files use into SI."""

from __future__ import annotations

import math
from typing import Tuple

#: Of X-Plane's sphere, solved from a captured pair of rows 20 and 21 (`sim/physics/earth_radius_m`). Latitudes and
#: longitudes are angles on it; WGS 84 is some 20 m off at 3 km.
EARTH_RADIUS_M = 6378145.0
GRAVITY_MPS2 = 9.80665  #: at every height
FOOT_M = 0.3048
KNOT_MPS = 1852.0 / 3600.0


def moved(latitude: float, longitude: float, north: float, east: float) -> Tuple[float, float]:
    """A place [deg] so many metres away, for distances that are short on the earth."""
    across = EARTH_RADIUS_M * max(math.cos(math.radians(latitude)), 1e-6)
    further = longitude + math.degrees(east / across)
    return latitude + math.degrees(north / EARTH_RADIUS_M), (further + 180.0) % 360.0 - 180.0
