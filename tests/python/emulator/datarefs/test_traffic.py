"""Other aircraft: those that the emulator flies, and those that clients place."""

from __future__ import annotations

import math

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.units import EARTH_RADIUS_M

PLANE = "sim/multiplayer/position/" + "plane{}_"
OVERRIDE = "sim/operation/override/override_planepath[{}]"


@pytest.fixture(name="bench")
def fixture_bench():
    benches = []

    def make(**options):
        benches.append(EmulatorFixture(initial=InitialState(latitude_deg=37.4602, longitude_deg=126.4407), **options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


def pose(emulator, number):
    plane = PLANE.format(number)
    return emulator.read(*(plane + leaf for leaf in ("x", "y", "z", "the", "phi", "psi", "v_x", "v_y", "v_z")))


def test_one_stands_on_the_apron_where_none_flies(bench):
    emulator = bench()
    emulator.step(30)
    other = emulator.sim.traffic.aircraft[1]
    before = (other.latitude_deg, other.longitude_deg)
    emulator.step(30)
    assert (other.latitude_deg, other.longitude_deg, other.altitude_m) == (*before, 0.0)
    # Heading north: 215 m east. One degree of longitude is R * pi / 180 * cos(latitude) = 88361 m at 37.4602 deg.
    assert other.longitude_deg - 126.4407 == pytest.approx(215.0 / 88361.0, rel=1e-4)
    assert pose(emulator, 2) == pytest.approx([0.0] * 9), "there is no second one"


def test_the_apron_is_where_the_aerodrome_is(bench):
    emulator = bench(aerodrome=(37.0, 126.0, 90.0))
    emulator.step()
    other = emulator.sim.traffic.aircraft[1]
    # Heading east: 215 m south. One degree of latitude is R * pi / 180 = 111317 m.
    assert (other.latitude_deg, other.longitude_deg) == pytest.approx((37.0 - 215.0 / 111317.0, 126.0), abs=1e-6)
    assert other.heading_deg == 90.0


def test_those_that_fly_go_straight_on_as_they_show(bench):
    emulator = bench(traffic=2)
    emulator.step(2)
    first = pose(emulator, 2)
    emulator.step(60)
    second = pose(emulator, 2)
    period = 61 / 60.0  # reading takes one
    for axis in range(3):
        assert second[axis] - first[axis] == pytest.approx(first[axis + 6] * period, abs=0.02)
    assert math.hypot(*first[6:9]) == pytest.approx(60.0, abs=1e-3)
    assert first[5] == pytest.approx(emulator.sim.frame.psi - emulator.sim.frame.true_psi, abs=0.1), "heading north"


def test_written_positions_count_under_the_override_alone(bench):
    emulator = bench()
    client = emulator.client()
    plane = PLANE.format(3)
    x, y, z = emulator.sim.frame.position
    writes = {"x": x + 500.0, "y": y, "z": z - 800.0, "psi": 90.0, "phi": 15.0, "the": 2.0, "v_x": 55.0}
    for leaf, value in writes.items():
        client.send(protocol.DrefWrite(plane + leaf, value))
    emulator.step(2)
    assert 3 not in emulator.sim.traffic.aircraft
    client.send(protocol.DrefWrite(OVERRIDE.format(3), 1.0))
    for leaf, value in writes.items():
        client.send(protocol.DrefWrite(plane + leaf, value))
    emulator.step(2)
    assert emulator.sim.traffic.held(3)
    shown = pose(emulator, 3)
    assert shown[:6] == pytest.approx([x + 500.0, y, z - 800.0, 2.0, 15.0, 90.0], abs=0.01)
    other = emulator.sim.traffic.aircraft[3]
    expected = emulator.sim.frame.local.to_geodetic(x + 500.0, y, z - 800.0)
    assert (other.latitude_deg, other.longitude_deg) == pytest.approx(expected[:2], abs=1e-7)
    assert other.velocity[1] == pytest.approx(55.0, abs=0.2), "east, turned to the local level"
    emulator.step(30)
    assert pose(emulator, 3)[0] == pytest.approx(x + 500.0, abs=0.01), "held"
    client.send(protocol.DrefWrite(OVERRIDE.format(3), 0.0))
    emulator.step(61)
    assert pose(emulator, 3)[0] == pytest.approx(x + 555.0, abs=2.0), "given back, it flies on"


def test_vehx_holds_another_aircraft_too(bench):
    emulator = bench()
    client = emulator.client()
    client.send(protocol.VehiclePose("VEHX", 5, 37.5, 126.5, 700.0, 120.0, 3.0, -10.0))
    emulator.step(5)
    other = emulator.sim.traffic.aircraft[5]
    assert (other.latitude_deg, other.longitude_deg, other.altitude_m) == (37.5, 126.5, 700.0)
    assert (other.roll_deg, other.pitch_deg, other.heading_deg) == (-10.0, 3.0, 120.0)
    assert emulator.read(OVERRIDE.format(5)) == pytest.approx([1.0])
    assert emulator.read(PLANE.format(5) + "lat")[0] == pytest.approx(37.5, abs=1e-5)
    client.send(protocol.VehiclePose("VEHX", 5, 37.5, 190.0, 700.0, 120.0, 3.0, -10.0))
    assert emulator.read(PLANE.format(5) + "lon") == [-170.0]


def test_rows_22_to_24_show_the_first_seven(bench):
    emulator = bench(traffic=9)
    client = emulator.client()
    client.send(protocol.NetworkTarget(64, "127.0.0.1", client.port, True))
    client.send(protocol.RowSelection("DSEL", (22, 23, 24)))
    emulator.step()
    rows = protocol.decode_data(client.received()[-1]).as_dict()
    others = [emulator.sim.traffic.aircraft[number] for number in range(1, 8)]
    assert rows[22][1:] == pytest.approx([other.latitude_deg for other in others], abs=4e-6)
    assert rows[23][1:] == pytest.approx([other.longitude_deg for other in others], abs=8e-6)
    assert rows[24][1:] == pytest.approx([other.altitude_m / 0.3048 for other in others], rel=1e-6)


def test_tcas_reports_distance_bearing_and_height(bench):
    emulator = bench()
    m = emulator.sim.model.state
    client = emulator.client()
    north = m.latitude_deg + math.degrees(2000.0 / EARTH_RADIUS_M)
    client.send(protocol.VehiclePose("VEHX", 2, north, m.longitude_deg, m.altitude_m + 100.0, 0.0, 0.0, 0.0))
    emulator.step(1)
    relative = "sim/cockpit2/tcas/indicators/relative_"
    distance, bearing, height = emulator.read(
        relative + "distance_mtrs[2]", relative + "bearing_degs[2]", relative + "altitude_mtrs[2]"
    )
    assert distance == pytest.approx(math.hypot(2000.0, 100.0), abs=5.0), "a frame of flight away"
    assert bearing == pytest.approx(-emulator.sim.frame.true_psi, abs=0.5)
    assert height == pytest.approx(100.0, abs=1.0)
    codes = emulator.read("sim/cockpit2/tcas/targets/modeS_id[2]", "sim/cockpit2/tcas/targets/modeC_code[2]")
    assert codes == pytest.approx([0x710002, 2002])


def test_the_oldest_version_has_no_targets(bench):
    emulator = bench(version="11.40")
    assert not emulator.sim.store.dataref("sim/cockpit2/tcas/targets/modeS_id").visible


def test_the_command_that_freezes_the_users_aircraft_leaves_the_others_theirs(bench):
    emulator = bench()
    overrides = [OVERRIDE.format(number) for number in range(4)]
    emulator.write({overrides[1]: 1.0})
    client = emulator.client()
    for frozen in (1.0, 0.0):
        client.send(protocol.CommandRequest("sim/operation/freeze_toggle"))
        assert emulator.read(*overrides) == [frozen, 1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("otherwise", "vehx", "written"), [("other-aircraft", False, True), ("other-written", True, False)]
)
def test_otherwise_a_way_moves_nothing(bench, otherwise, vehx, written):
    emulator = bench(otherwise=frozenset({otherwise}))
    client = emulator.client()
    client.send(protocol.VehiclePose("VEHX", 4, 37.5, 126.5, 700.0, 0.0, 0.0, 0.0))
    client.send(protocol.DrefWrite(OVERRIDE.format(6), 1.0))
    client.send(protocol.DrefWrite(PLANE.format(6) + "y", 900.0))
    emulator.step(2)
    assert (4 in emulator.sim.traffic.aircraft) is vehx
    assert (6 in emulator.sim.traffic.aircraft) is written
