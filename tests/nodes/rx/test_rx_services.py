"""The services of rx_node: datarefs, terrain, origin."""

from __future__ import annotations

import math
import re
import socket
import struct
import threading
import time

import numpy as np
import pytest

from support.nodes.rx_fixtures import (
    EARTH_RADIUS_M,
    KINEMATIC,
    fixture_rx,  # noqa: F401
)
from xplane_bridge.harness.ports import free_udp_port

#: What a request's timeout of 0 means.
DEFAULT_TIMEOUT_S = 1.0

# --- services ---------------------------------------------------------------------------------------------------------


def test_get_dataref(world, rx):
    from xplane_bridge.srv import GetDataref

    world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for()
    answer = world.call("get_dataref", GetDataref, "sim/version/xplane_internal_version", 10.0)
    assert answer.success
    assert answer.values == (115501.0,)
    assert math.isfinite(answer.sim_time)
    answer = world.call("get_dataref", GetDataref, "sim/aircraft/view/acf_ICAO[0:4]", 10.0)
    assert (
        "".join(chr(int(value)) for value in answer.values)
        == world.links.wait_for(lambda link: link.aircraft_icao).aircraft_icao
    )


def test_get_terrain_of_any_place(world, rx):
    from xplane_bridge.srv import GetTerrain

    emulator = world.emulator("--terrain", 250, "--alt", 1000, "--xpc-port", 0)
    rx(xpc_port=int(re.search(r'"xpc_port": (\d+)', emulator.output()).group(1)))
    world.states.wait_for()
    answer = world.call("get_terrain", GetTerrain, 36.5, 127.25, 10.0)
    assert answer.success, answer.result.message
    assert (answer.latitude, answer.longitude) == (36.5, 127.25)
    assert answer.terrain_height == pytest.approx(250.0, abs=0.1)
    assert not answer.is_water


def test_get_terrain_says_why_not(world, rx):
    """A stand-in for the plugin plays what the emulator does not: silence, and a probe that fails."""
    from xplane_bridge.srv import GetTerrain

    world.emulator(*KINEMATIC)
    port = free_udp_port()
    rx(xpc_port=port)
    world.states.wait_for()

    def refusal(code, *place):
        answer = world.call("get_terrain", GetTerrain, *place)
        assert not answer.success
        assert math.isnan(answer.terrain_height)
        assert answer.result.code == code, answer.result.message
        return answer.result.message

    refused, timeout = 2, 5
    assert "give a place" in refusal(refused, 0.0, 0.0, 0.0)
    assert "latitude must be from -90 to 90" in refusal(refused, 91.0, 10.0, 0.0)
    assert "latitude must be from -90 to 90" in refusal(refused, math.nan, 10.0, 0.0)
    assert "timeout must be" in refusal(refused, 37.0, 127.0, 60.0)
    assert f"nothing listens on 127.0.0.1:{port}" in refusal(timeout, 37.0, 127.0, 5.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plugin:
        plugin.bind(("127.0.0.1", port))
        assert f"nothing answers from 127.0.0.1:{port}" in refusal(timeout, 37.0, 127.0, 0.5)
        began = time.monotonic()
        refusal(timeout, 37.0, 127.0, 0.0)
        assert time.monotonic() - began >= DEFAULT_TIMEOUT_S
        plugin.settimeout(10.0)

        def fail_the_first_probe() -> None:  # there is no answer to GETT then
            question = asker = None
            while question != struct.pack("<4sxB", b"GETP", 0):
                question, asker = plugin.recvfrom(2048)
            plugin.sendto(struct.pack("<4sxB3d4f", b"POSI", 1, 36.0, 127.0, 300.0, *[0.0] * 4), asker)

        def fail_the_probe() -> None:
            question = asker = None
            while question != struct.pack("<4sxB3d", b"GETT", 0, 38.0, 128.0, 0.0):  # not what was asked until now
                question, asker = plugin.recvfrom(2048)
            plugin.sendto(struct.pack("<4sxB3d6f2i", b"TERR", 0, *[-998.0] * 3, *[0.0] * 6, 0, 0), asker)

        for fail in (fail_the_probe, fail_the_first_probe):
            probe = threading.Thread(target=fail)
            probe.start()
            assert "finds no terrain there" in refusal(timeout, 38.0, 128.0, 10.0)
            probe.join(10.0)


@pytest.mark.parametrize(
    ("name", "timeout", "code", "part"),
    [
        ("sim/no/such_dataref", 0.5, 5, "sim/no/such_dataref"),
        ("sim/no/such_dataref", 0.0, 5, "sim/no/such_dataref"),
        ("no blanks please", 0.0, 2, "ASCII without blanks"),
        ("sim/a[3:1]", 0.0, 2, "[i:j]"),
        ("sim/time/paused", 60.0, 2, "timeout"),
        ("sim/time/paused", math.nan, 2, "timeout"),
    ],
)
def test_get_dataref_says_why_not(world, rx, name, timeout, code, part):
    from xplane_bridge.srv import GetDataref

    world.emulator(*KINEMATIC)
    rx()
    before = world.states.wait_for().sim_time
    began = time.monotonic()
    answer = world.call("get_dataref", GetDataref, name, timeout)
    assert not answer.success
    assert answer.result.code == code
    waited = timeout or DEFAULT_TIMEOUT_S
    assert code != 5 or time.monotonic() - began >= waited
    assert code != 5 or answer.sim_time - before > 0.8 * waited  # of the newest state once it is read
    assert part in answer.result.message


def test_a_read_in_vain_leaves_the_next_its_turn(world, rx):
    from xplane_bridge.srv import GetDataref

    world.emulator(*KINEMATIC, "--fps", 20)
    rx()
    world.states.wait_for()
    answer = world.call("get_dataref", GetDataref, "sim/no/such_dataref[0:1024]", 2.0)
    assert "or not all 1024 elements could be asked for in time" in answer.result.message
    for _ in range(3):
        assert world.call("get_dataref", GetDataref, "sim/time/paused", 0.0).success


def test_set_origin_starts_a_new_position_epoch(world, rx):
    from sensor_msgs.msg import NavSatFix
    from xplane_bridge.srv import SetOrigin

    world.emulator(*KINEMATIC)
    origins = world.watch("origin", NavSatFix)
    rx(geoid_undulation=20.0)
    first = world.states.wait_for()
    origin = origins.wait_for()
    # The first state heard may be of some seconds later.
    north, east = np.degrees(np.array([first.position_north, first.position_east]) / EARTH_RADIUS_M)
    there = first.latitude - north, first.longitude - east / np.cos(np.radians(first.latitude))
    assert (origin.latitude, origin.longitude) == pytest.approx(there, abs=5e-4)

    answer = world.call("set_origin", SetOrigin, False, 37.0, 127.0, 100.0)
    assert answer.success
    assert answer.position_epoch == first.position_epoch + 1
    state = world.states.wait_for(lambda s: s.position_epoch == answer.position_epoch)
    # North of the origin on the sphere, dropped below its tangent plane.
    north = np.radians(state.latitude - 37.0) * EARTH_RADIUS_M
    assert state.position_north == pytest.approx(north, rel=0.01)
    origin = origins.wait_for(lambda fix: fix.latitude == 37.0)
    assert origin.altitude == 120.0

    answer = world.call("set_origin", SetOrigin, True, 0.0, 0.0, 0.0)
    state = world.states.wait_for(lambda s: s.position_epoch == answer.position_epoch)
    assert np.hypot(state.position_north, state.position_east) < 100.0

    for wrong, said in (
        ((91.0, 0.0, 0.0), "latitude must be from -90 to 90"),
        ((37.0, 127.0, 1e12), "from -1000 to 100000"),
    ):
        answer = world.call("set_origin", SetOrigin, False, *wrong)
        assert not answer.success
        assert said in answer.result.message


def test_origin_from_parameters(world, rx):
    world.emulator(*KINEMATIC, "--lat", 37.46, "--lon", 126.44, "--alt", 1000)
    rx(origin={"latitude": 37.46, "longitude": 126.44, "altitude_msl": 900})
    state = world.states.wait_for()
    assert state.position_down == pytest.approx(-(state.altitude_msl - 900.0), abs=1.0)
