"""X-Plane's Earth, and what turns the units that X-Plane, JSBSim and airport files use into SI."""

from __future__ import annotations

EARTH_RADIUS_M = 6378145.0  #: of X-Plane's sphere
GRAVITY_MPS2 = 9.80665
FOOT_M = 0.3048
KNOT_MPS = 1852.0 / 3600.0
