"""X-Plane's Earth, and what turns the units that X-Plane, JSBSim and airport files use into SI."""

from __future__ import annotations

#: Of X-Plane's sphere, solved from a captured pair of rows 20 and 21 (`sim/physics/earth_radius_m`). Latitudes and
#: longitudes are angles on it; WGS 84 is some 20 m off at 3 km.
EARTH_RADIUS_M = 6378145.0
GRAVITY_MPS2 = 9.80665  #: at every height
FOOT_M = 0.3048
KNOT_MPS = 1852.0 / 3600.0
