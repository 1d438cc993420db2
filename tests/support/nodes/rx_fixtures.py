"""rx_node as its tests start it."""

from __future__ import annotations

import pytest

EARTH_RADIUS_M = 6378145.0
ALL_VALID = 262143
KINEMATIC = ("--model", "kinematic")


@pytest.fixture(name="transport", params=["rref", "data"])
def fixture_transport(request, world):
    """Both transports, one after the other; data on a port of the test's own."""
    world.set_param("transport", request.param)
    world.set_param("data_port", 0)
    return request.param


both_transports = pytest.mark.usefixtures("transport")


@pytest.fixture(name="rx")
def fixture_rx(world):
    """Starts rx_node with private parameters and watches its first topics."""
    from xplane_bridge.msg import FlightState, LinkState

    def start(**params):
        world.states = world.watch("flight_state", FlightState)
        world.links = world.watch("link_state", LinkState)
        return world.start("rx_node", params)

    return start
