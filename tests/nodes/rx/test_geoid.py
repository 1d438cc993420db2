"""rx_node's parameter geoid, by a small model of GeographicLib: a tenth of the latitude [m/deg], north +."""

from __future__ import annotations

import struct

import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import joined
from xplane_bridge.harness import wait_until

#: What a build says that has no GeographicLib.
WITHOUT = "this build has no GeographicLib"


def write_model(folder):
    """The model, at points 10 deg apart, in the form of GeographicLib's files."""
    head = (
        "P5\n# Geoid file in PGM format for the GeographicLib::Geoid class\n# Description synthetic\n"
        "# DateTime 2020-01-01 00:00:00\n# MaxBilinearError 0\n# RMSBilinearError 0\n# MaxCubicError 0\n"
        "# RMSCubicError 0\n# Offset -100\n# Scale 0.01\n# Origin 90N 0E\n# AREA_OR_POINT Point\n"
        "# Vertical_Datum WGS84\n36 19\n65535\n"
    )
    rows = b"".join(struct.pack(">36H", *[(latitude // 10 + 100) * 100] * 36) for latitude in range(90, -91, -10))
    (folder / "synthetic.pgm").write_bytes(head.encode("ascii") + rows)


def start(world, **params):
    """rx_node with these parameters, and whether it runs on: it has published, or ended with an error."""
    from sensor_msgs.msg import NavSatFix
    from xplane_bridge.msg import FlightState

    world.emulator("--model", "kinematic", "--lat", "40", "--lon", "10")
    world.fixes = world.watch("global_position/global", NavSatFix)
    world.origins = world.watch("origin", NavSatFix)
    world.states = world.watch("flight_state", FlightState)
    node = world.start("rx_node", params)
    wait_until(lambda: (world.fixes.messages and world.origins.messages) or not node.running, WAIT_S, "a fix or an end")
    return node


def test_altitude_is_above_the_ellipsoid_of_the_model(world):
    write_model(world.folder)
    node = start(world, geoid="synthetic", geoid_folder=str(world.folder))
    if not node.running:
        assert WITHOUT in node.output()
        pytest.skip("the package was built without GeographicLib")
    # The topics are connected one after the other.
    wait_until(lambda: joined(world.fixes, world.states), WAIT_S, "a fix and its state")
    fix = joined(world.fixes, world.states)[0]
    state = world.states.wait_for(lambda s: s.header.stamp == fix.header.stamp)
    assert fix.altitude - state.altitude_msl == pytest.approx(0.1 * state.latitude, abs=0.01)
    assert fix.altitude - state.altitude_msl == pytest.approx(4.0, abs=0.1)


def test_model_that_is_not_there_is_an_error(world):
    node = start(world, geoid="egm96-5", geoid_folder=str(world.folder))
    assert node.wait(WAIT_S) != 0
    assert "rx_node/geoid is egm96-5: " in node.output()
    assert WITHOUT in node.output() or "geographiclib-get-geoids egm96-5" in node.output()


def test_constant_does_not_go_with_a_model(world):
    node = start(world, geoid="egm96-5", geoid_undulation=20.0)
    assert node.wait(WAIT_S) != 0
    assert "geoid_undulation" in node.output()
    assert "0 with geoid egm96-5" in node.output()
