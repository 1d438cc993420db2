"""rx_node against X-Plane's stand-in: what it publishes, and that it survives whatever X-Plane does."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import re
import signal
import socket
import struct
import sys
import threading
import xmlrpc.client

import numpy as np
import pytest

from xplane_bridge import __version__, protocol
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.resources import config_file, program

EARTH_RADIUS_M = 6378145.0
ALL_VALID = 262143
KINEMATIC = ("--model", "kinematic")
MISSION = {
    "engines": "EngineStates",
    "surfaces": "SurfaceStates",
    "controls": "ControlStates",
    "electrical": "ElectricalState",
    "autopilot": "AutopilotState",
    "warnings": "WarningState",
    "fuel": "FuelState",
    "sim": "SimStatus",
    "navigation": "NavigationState",
    "instruments": "InstrumentState",
    "environment": "EnvironmentState",
}


@pytest.fixture(params=["rref", "data"])
def transport(request, world):
    """Both transports, one after the other; data on a port of the test's own."""
    world.set_param("transport", request.param)
    world.set_param("data_port", 0)
    return request.param


both_transports = pytest.mark.usefixtures("transport")


@pytest.fixture
def rx(world):
    """Starts rx_node with private parameters and watches its first topics."""
    from xplane_bridge.msg import FlightState, LinkState

    def start(**params):
        world.states = world.watch("flight_state", FlightState)
        world.links = world.watch("link_state", LinkState)
        return world.start("rx_node", params)

    return start


def wait_for_link(world, name):
    """Waits for a state of the link, by name, after the one waited for last; returns the message."""
    return world.links.then_wait_for(lambda link: link.state_name == name, 20.0, f"link state {name}")


def free_udp_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def numbers_of(message, name=""):
    """Every number of a message with the field's name."""
    if hasattr(message, "__slots__"):
        for field in message.__slots__:
            if field != "header":
                yield from numbers_of(getattr(message, field), f"{name}.{field}" if name else field)
    elif isinstance(message, (tuple, list)):
        for i, value in enumerate(message):
            yield from numbers_of(value, f"{name}[{i}]")
    elif isinstance(message, (int, float)):
        yield name, message


def earth_fixed(latitude_deg, longitude_deg, height):
    lat, lon = np.radians(latitude_deg), np.radians(longitude_deg)
    radius = EARTH_RADIUS_M + np.asarray(height)
    return radius[:, None] * np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)


def rotation(q):
    """Rotation matrix of a geometry_msgs/Quaternion."""
    w, x, y, z = q.w, q.x, q.y, q.z
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def xyz(v):
    return np.array([v.x, v.y, v.z])


# --- what is published ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [11, 12])
def test_states_are_complete_true_and_consistent(world, rx, transport, version):
    """Every value known from the first message on; all are the emulator's; d(position)/dt is the twist."""
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import Imu, NavSatFix

    truth_file = world.folder / "truth.csv"
    emulator = world.emulator(
        "--version", version, "--truth", truth_file, "--pilot", config_file("scenarios", "demo.yaml"), "--wind", "230/7"
    )
    odoms = world.watch("odom", Odometry)
    imus = world.watch("imu/data", Imu)
    fixes = world.watch("global_position/global", NavSatFix)
    rx()
    world.states.wait_for_count(600, 60.0)
    link = world.links.last
    assert link.state_name == "CONNECTED"
    assert link.transport == transport
    assert link.xplane_version // 10000 == version
    emulator.stop()

    states = world.states.messages[:600]
    for state in states:
        assert state.valid == ALL_VALID, f"valid {state.valid:#x} at sim_time {state.sim_time}"
        missing = [name for name, value in numbers_of(state) if not math.isfinite(value)]
        assert not missing
        assert state.header.frame_id == "base_link_frd"
    stamps = np.array([state.header.stamp.to_sec() for state in states])
    assert np.all(np.diff(stamps) > 0)
    assert {state.epoch for state in states} == {states[0].epoch}

    with truth_file.open(newline="") as lines:
        truth = {np.float32(row["sim_time"]): row for row in csv.DictReader(lines)}
    rows = [truth[np.float32(state.sim_time)] for state in states]

    def column(name):
        return np.array([float(row[name]) for row in rows])

    true_position = earth_fixed(column("latitude_deg"), column("longitude_deg"), column("altitude_m"))
    position = earth_fixed(
        [state.latitude for state in states],
        [state.longitude for state in states],
        [state.altitude_msl for state in states],
    )
    assert np.linalg.norm(position - true_position, axis=1).max() < 0.01
    np.testing.assert_allclose([state.roll_deg for state in states], column("roll_deg"), atol=1e-3)
    np.testing.assert_allclose([state.pitch_deg for state in states], column("pitch_deg"), atol=1e-3)
    heading_error = np.array([state.heading_true_deg for state in states]) - column("heading_deg")
    assert np.abs((heading_error + 180.0) % 360.0 - 180.0).max() < 1e-3
    for axis, name in enumerate("pqr"):
        rates = [xyz(state.angular_velocity)[axis] for state in states]
        np.testing.assert_allclose(rates, column(f"{name}_radps"), atol=1e-5)
    for axis, name in enumerate(("north", "east", "down")):
        velocity = [xyz(state.velocity_ned)[axis] for state in states]
        np.testing.assert_allclose(velocity, column(f"v_{name}_mps"), atol=1e-3)
        wind = [xyz(state.wind_ned)[axis] for state in states]
        np.testing.assert_allclose(wind, column(f"wind_{name}_mps"), atol=0.02)
    for axis, name in enumerate("xyz"):
        force = [xyz(state.specific_force)[axis] for state in states]
        np.testing.assert_allclose(force, column(f"specific_force_{name}_mps2"), atol=1e-3)
    np.testing.assert_allclose([state.beta_deg for state in states], column("beta_deg"), atol=0.05)
    np.testing.assert_allclose([state.alpha_deg for state in states], column("alpha_deg"), atol=0.05)

    by_stamp = {message.header.stamp: message for message in odoms.messages}
    together = [by_stamp[state.header.stamp] for state in states]
    places = np.array([xyz(odom.pose.pose.position) for odom in together])
    twists = np.array([rotation(odom.pose.pose.orientation) @ xyz(odom.twist.twist.linear) for odom in together])
    sim_time = np.array([state.sim_time_unwrapped for state in states])
    for first in range(0, len(states) - 61, 30):
        last = first + 60
        speed = (places[last] - places[first]) / (sim_time[last] - sim_time[first])
        steps = np.diff(sim_time[first : last + 1])[:, None]
        way = np.sum((twists[first:last] + twists[first + 1 : last + 1]) / 2 * steps, axis=0)
        assert np.abs(speed - way / (sim_time[last] - sim_time[first])).max() < 0.02

    fix = {message.header.stamp: message for message in fixes.messages}[states[100].header.stamp]
    assert (fix.latitude, fix.longitude) == (states[100].latitude, states[100].longitude)
    assert fix.altitude == states[100].altitude_msl
    imu = {message.header.stamp: message for message in imus.messages}[states[100].header.stamp]
    assert imu.linear_acceleration.z == pytest.approx(-states[100].specific_force.z)


@both_transports
def test_mission_state_arrives_complete(world, rx):
    import xplane_bridge.msg

    world.emulator()
    logs = {group: world.watch(f"mission/{group}", getattr(xplane_bridge.msg, name)) for group, name in MISSION.items()}
    rx()
    for group, log in logs.items():
        everything = getattr(xplane_bridge.msg, MISSION[group]).VALID_ALL
        message = log.wait_for(lambda m, bits=everything: m.valid == bits, 20.0, "complete state")
        assert math.isfinite(message.sim_time)
        assert message.header.stamp.to_sec() > 1e9
    engines = logs["engines"].wait_for_next()
    assert engines.count == 2
    assert engines.engine_speed[0] > 500.0
    assert math.isnan(engines.engine_speed[2])
    surfaces = logs["surfaces"].wait_for_next()
    assert math.isfinite(surfaces.delta_aileron)


def test_a_frame_split_over_datagrams_is_joined(world, rx):
    world.emulator(*KINEMATIC, "--rref-split", 40)
    rx()
    states = world.states.wait_for_count(100, 30.0)
    assert {state.valid for state in states} == {ALL_VALID}
    counts = [state.frame_count for state in states]
    assert counts == list(range(counts[0], counts[0] + 100))


def test_groups_at_rate_zero_have_no_topic(world, rx):
    import rospy

    world.emulator(*KINEMATIC)
    rx(rates={"fuel": 0, "engines": 3})
    world.states.wait_for()
    topics = dict(rospy.get_published_topics(world.namespace))
    assert f"{world.namespace}/mission/engines" in topics
    assert f"{world.namespace}/mission/fuel" not in topics


def test_max_publish_rate_thins_evenly(world, rx):
    world.emulator(*KINEMATIC, "--fps", 60)
    rx(max_publish_rate=20)
    states = world.states.wait_for_count(40, 30.0)
    counts = np.diff([state.frame_count for state in states])
    assert counts.mean() == pytest.approx(3.0, abs=0.2)
    assert counts.min() >= 2


def test_transforms(world, rx):
    from tf2_msgs.msg import TFMessage

    world.emulator(*KINEMATIC)
    tf = world.watch("/tf", TFMessage)
    static = world.watch("/tf_static", TFMessage)
    world.set_param("map_frame", "world")
    rx(publish_tf=True)
    message = tf.wait_for(lambda m: m.transforms[0].header.frame_id == "world")
    assert message.transforms[0].child_frame_id == "base_link"
    pairs = {
        (t.header.frame_id, t.child_frame_id)
        for t in static.wait_for(lambda m: m.transforms[0].child_frame_id == "base_link_frd").transforms
    }
    assert pairs == {("base_link", "base_link_frd"), ("world", "map_ned")}


def test_no_transform_unless_asked_for(world, rx):
    from tf2_msgs.msg import TFMessage

    world.emulator(*KINEMATIC)
    tf = world.watch("/tf", TFMessage)
    rx()
    world.states.wait_for_count(20)
    assert not tf.messages


def test_wind_comes_slower(world, rx):
    from geometry_msgs.msg import TwistWithCovarianceStamped

    world.emulator(*KINEMATIC, "--wind", "270/10")
    wind = world.watch("wind", TwistWithCovarianceStamped)
    rx(rates={"wind": 5})
    first, second = wind.wait_for_count(2)
    assert first.header.frame_id == "map"
    assert (first.twist.twist.linear.x, first.twist.twist.linear.y) == pytest.approx((10.0, 0.0), abs=0.01)
    assert (second.header.stamp - first.header.stamp).to_sec() == pytest.approx(0.2, abs=0.05)


def test_position_from_plane_connect(world, rx):
    from xplane_bridge.msg import FlightState

    emulator = world.emulator("--start", "ground", "--xpc-port", 0)
    plugin = int(re.search(r'"xpc_port": (\d+)', emulator.output()).group(1))
    rx(position_source="xpc", xpc_port=plugin)
    state = world.states.wait_for()
    assert state.position_source == FlightState.POSITION_XPC
    assert state.valid & FlightState.VALID_POSITION
    wire = world.wire(emulator.port)
    assert state.latitude == pytest.approx(wire.read("sim/flightmodel/position/latitude"), abs=1e-5)  # float32 there
    assert state.longitude == pytest.approx(wire.read("sim/flightmodel/position/longitude"), abs=2e-5)
    assert state.altitude_msl == pytest.approx(wire.read("sim/flightmodel/position/elevation"), abs=0.01)


def test_plane_connect_that_is_not_installed_is_said(world, rx):
    world.emulator("--start", "ground")
    rx(position_source="xpc", xpc_port=free_udp_port())
    world.wait_for_diagnostics("position", lambda status: "X-Plane Connect does not answer" in status.message)


def test_listed_datarefs_and_scalar_topics(world, rx):
    from std_msgs.msg import Float64
    from xplane_bridge.msg import DatarefValues

    emulator = world.emulator(*KINEMATIC)
    values = world.watch("datarefs", DatarefValues)
    scalar = world.watch("datarefs/flaps", Float64)
    rx(
        datarefs=[
            {"name": "sim/cockpit2/controls/flap_ratio", "rate": 20, "topic": "flaps"},
            {"name": "sim/cockpit2/engine/actuators/throttle_ratio[0:2]", "rate": 5},
        ]
    )
    message = values.wait_for(lambda m: np.all(np.isfinite(m.values)))
    assert message.names == [
        "sim/cockpit2/controls/flap_ratio",
        "sim/cockpit2/engine/actuators/throttle_ratio[0]",
        "sim/cockpit2/engine/actuators/throttle_ratio[1]",
    ]
    world.wire(emulator.port).send(protocol.DrefWrite("sim/cockpit2/controls/flap_ratio", 0.5))
    assert scalar.wait_for(lambda m: m.data == 0.5)
    assert values.wait_for(lambda m: m.values[0] == 0.5)
    assert math.isfinite(values.wait_for_next().sim_time)


@pytest.mark.parametrize("unknown", ["omit", "zero"])
def test_an_unknown_dataref_is_named(world, rx, unknown):
    from xplane_bridge.msg import DatarefValues

    world.emulator(*KINEMATIC, "--unknown-datarefs", unknown)
    values = world.watch("datarefs", DatarefValues)
    rx(datarefs=[{"name": "sim/no/such_dataref"}, {"name": "sim/time/paused"}])
    if unknown == "omit":
        assert math.isnan(values.wait_for().values[0])
        world.wait_for_diagnostics("link to X-Plane", lambda s: "sim/no/such_dataref" in s.message, 40.0)
    else:  # X-Plane then gives no way to distinguish it from a real zero
        assert values.wait_for().values[0] == 0.0
    world.states.wait_for_count(10)


def test_data_rows_are_passed_on_as_they_came(world, rx):
    from xplane_bridge.msg import DataRows

    world.set_param("transport", "data")
    world.set_param("data_port", 0)
    world.emulator(*KINEMATIC)
    rows = world.watch("data_rows", DataRows)
    rx(extra_rows=[132])
    message = rows.wait_for(lambda m: 132 in m.index)
    assert len(message.values) == 8 * len(message.index)
    assert bytes(message.label)[:4] == b"DATA"
    mach_slot = message.index.index(4) * 8
    assert message.values[mach_slot] == pytest.approx(world.states.wait_for().mach, abs=0.01)
    assert message.values[message.index.index(132) * 8 + 2] == -999.0


# --- how it was made --------------------------------------------------------------------------------------------------


@both_transports
def test_the_passport_says_how_the_flight_is_made_and_changes_with_it(world, rx):
    from xplane_bridge.msg import Experiment

    emulator = world.emulator(*KINEMATIC)
    text = "name: fixed_wing\n"
    world.set_param("experiment", {"aircraft_file": text, "pilot": "Kim"})
    passports = world.watch("experiment", Experiment)
    rx(publish_tf=False)
    first = passports.wait_for(timeout=30.0)
    parameters = json.loads(first.parameters)
    assert parameters["experiment"]["pilot"] == "Kim"
    assert parameters["rx_node"] == {"publish_tf": False}
    assert first.parameters_sha256 == hashlib.sha256(first.parameters.encode()).hexdigest()
    assert first.aircraft_file_sha256 == hashlib.sha256(text.encode()).hexdigest()
    assert first.aircraft_file == "fixed_wing"
    assert first.package_version == __version__
    assert re.fullmatch(r"([0-9a-f]{40}\+?)?", first.commit)
    assert first.aircraft_description
    assert first.xplane_version == 115501
    settings = dict(zip(first.settings, first.setting_values))
    assert settings["sim/time/sim_speed"] == 1.0
    assert all(math.isfinite(value) for value in settings.values()), settings
    assert not first.lockstep
    world.wire(emulator.port).send(protocol.DrefWrite("sim/time/sim_speed", 2.0))
    world.set_param("experiment/pilot", "Lee")
    passports.wait_for(lambda p: dict(zip(p.settings, p.setting_values))["sim/time/sim_speed"] == 2.0, 30.0)
    last = passports.wait_for(lambda p: "Lee" in p.parameters, 30.0)
    assert last.header.stamp > first.header.stamp
    assert len(passports.messages) <= 4


# --- services ---------------------------------------------------------------------------------------------------------


def test_get_dataref(world, rx):
    from xplane_bridge.srv import GetDataref

    world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for()
    answer = world.call("get_dataref", GetDataref, "sim/version/xplane_internal_version", 0.0)
    assert answer.success
    assert answer.values == (115501.0,)
    assert math.isfinite(answer.sim_time)
    answer = world.call("get_dataref", GetDataref, "sim/aircraft/view/acf_ICAO[0:4]", 2.0)
    assert (
        "".join(chr(int(value)) for value in answer.values)
        == world.links.wait_for(lambda link: link.aircraft_icao).aircraft_icao
    )


def test_get_terrain_of_any_place(world, rx):
    from xplane_bridge.srv import GetTerrain

    emulator = world.emulator("--terrain", 250, "--alt", 1000, "--xpc-port", 0)
    rx(xpc_port=int(re.search(r'"xpc_port": (\d+)', emulator.output()).group(1)))
    world.states.wait_for()
    answer = world.call("get_terrain", GetTerrain, 36.5, 127.25, 0.0)
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
        plugin.settimeout(10.0)

        def fail_the_probe() -> None:
            question = asker = None
            while question != struct.pack("<4sxB3d", b"GETT", 0, 38.0, 128.0, 0.0):  # not what was asked until now
                question, asker = plugin.recvfrom(2048)
            plugin.sendto(struct.pack("<4sxB3d6f2i", b"TERR", 0, *[-998.0] * 3, *[0.0] * 6, 0, 0), asker)

        probe = threading.Thread(target=fail_the_probe)
        probe.start()
        assert "finds no terrain there" in refusal(timeout, 38.0, 128.0, 5.0)
        probe.join(10.0)


@pytest.mark.parametrize(
    ("name", "timeout", "code", "part"),
    [
        ("sim/no/such_dataref", 0.5, 5, "sim/no/such_dataref"),
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
    world.states.wait_for()
    answer = world.call("get_dataref", GetDataref, name, timeout)
    assert not answer.success
    assert answer.result.code == code
    assert part in answer.result.message


def test_set_origin_starts_a_new_position_epoch(world, rx):
    from sensor_msgs.msg import NavSatFix
    from xplane_bridge.srv import SetOrigin

    world.emulator(*KINEMATIC)
    origins = world.watch("origin", NavSatFix)
    rx(geoid_undulation=20.0)
    first = world.states.wait_for()
    origin = origins.wait_for()
    assert (origin.latitude, origin.longitude) == pytest.approx((first.latitude, first.longitude), abs=1e-3)

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

    answer = world.call("set_origin", SetOrigin, False, 91.0, 0.0, 0.0)
    assert not answer.success
    assert "from -90 to 90" in answer.result.message


def test_origin_from_parameters(world, rx):
    world.emulator(*KINEMATIC, "--lat", 37.46, "--lon", 126.44, "--alt", 1000)
    rx(origin={"latitude": 37.46, "longitude": 126.44, "altitude_msl": 900})
    state = world.states.wait_for()
    assert state.position_down == pytest.approx(-(state.altitude_msl - 900.0), abs=1.0)


# --- whatever X-Plane does --------------------------------------------------------------------------------------------


@both_transports
def test_bridge_first(world, rx):
    port = free_udp_port()
    world.point_to(port)
    rx()
    link = wait_for_link(world, "SEARCHING")
    assert link.reason
    assert not world.states.messages
    world.emulator(*KINEMATIC, port=port)
    wait_for_link(world, "CONNECTED")
    world.states.wait_for(lambda state: state.valid == ALL_VALID)


def test_search_in_vain_is_said_on_the_console_in_link_state_and_in_diagnostics(world, rx):
    port = free_udp_port()
    world.point_to(port)
    node = rx()
    node.wait_for_line(rf"looking for X-Plane at 127\.0\.0\.1:{port}", 15)
    # Nothing listens there, and this computer's kernel says so.
    sentence = f"no answer from 127.0.0.1:{port}: that computer is there, but nothing listens on the port"
    world.links.wait_for(lambda link: link.state_name == "SEARCHING" and link.reason.startswith(sentence))
    node.wait_for_line(rf"WARN.*{sentence}", 15)
    status = world.wait_for_diagnostics("link to X-Plane", lambda status: sentence in status.message)
    assert status.message.count(sentence) == 1, status.message
    assert node.output().count(sentence) == 1


@both_transports
def test_no_flight_loaded_yet(world, rx):
    world.emulator(*KINEMATIC, "--load-time", 6)
    rx()
    world.wait_for_diagnostics("flight state", lambda s: "no flight is loaded" in s.message)
    assert not world.states.messages
    state = world.states.wait_for(timeout=30.0)
    assert state.valid == ALL_VALID
    assert state.altitude_msl > 100.0


@both_transports
def test_x_plane_killed_and_restarted(world, rx):
    emulator = world.emulator(*KINEMATIC)
    rx()
    # A restart differs from a gap by simulator time that runs anew.
    before = world.states.wait_for(lambda state: state.sim_time > 5.0, 30.0)
    epoch = wait_for_link(world, "CONNECTED").link_epoch
    emulator.kill()
    wait_for_link(world, "STALE")
    emulator.start()
    world.links.then_wait_for(lambda link: link.state_name == "CONNECTED" and link.link_epoch > epoch, 20.0)
    after = world.states.wait_for_next(lambda state: state.valid == ALL_VALID and state.sim_time < before.sim_time)
    assert after.epoch > before.epoch
    world.states.wait_for_count(20)


def test_lost_when_silent_for_long(world, rx):
    world.set_param("lost_after", 1.0)
    emulator = world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for()
    emulator.kill()
    link = wait_for_link(world, "LOST")
    assert link.silence >= 1.0
    world.wait_for_diagnostics("link to X-Plane", lambda s: s.level == 2 and "LOST" in s.message)


def test_found_by_beacon_and_again_on_another_port(world, rx):
    beacon_port = free_udp_port()
    world.set_param("beacon_port", beacon_port)

    def x_plane(name):
        command = [sys.executable, program("xplane_emulator"), *KINEMATIC, "--bind", "127.0.0.1", "--port", "0"]
        command += ["--beacon-target", f"239.255.1.1:{beacon_port}"]
        process = ManagedProcess(name, command, world.folder, env=world.env)
        process.start()
        ready = process.wait_for_line(r"^READY (\{.*\})", 60.0).group(1)
        return process, json.loads(ready)["port"]

    first, first_port = x_plane("first")
    try:
        rx()
        assert wait_for_link(world, "CONNECTED").port == first_port
        world.states.wait_for()
        first.kill()
        wait_for_link(world, "LOST")
    finally:
        first.stop()
    second, second_port = x_plane("second")
    try:
        link = world.links.then_wait_for(lambda m: m.state_name == "CONNECTED" and m.port == second_port, 30.0)
        assert link.host == "127.0.0.1"
        world.states.wait_for_next(timeout=30.0)
    finally:
        second.stop()


@both_transports
def test_pause_and_resume(world, rx):
    emulator = world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for_count(20)
    wire = world.wire(emulator.port)
    wire.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wait_for_link(world, "PAUSED")
    wire.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wait_for_link(world, "CONNECTED")
    states = world.states.wait_for_count(20)
    assert not states[-1].paused
    stamps = [state.header.stamp.to_sec() for state in world.states.messages]
    assert np.all(np.diff(stamps) > 0)


def test_another_aircraft_is_reported_and_starts_an_epoch(world, rx):
    emulator = world.emulator()
    rx()
    link = world.links.wait_for(lambda m: m.aircraft_icao)
    before = world.states.wait_for()
    world.wire(emulator.port).send(protocol.AircraftLoad(0, "Aircraft/xplane_bridge/multirotor/multirotor.acf"))
    other = world.links.then_wait_for(lambda m: m.aircraft_icao not in ("", link.aircraft_icao), 30.0)
    assert other.aircraft_description != link.aircraft_description
    world.states.wait_for_next(lambda state: state.epoch > before.epoch, 30.0)


@both_transports
def test_gap_of_seconds_is_survived(world, rx):
    world.emulator(*KINEMATIC, "--fault", "freeze=2s@8")
    rx()
    wait_for_link(world, "STALE")
    wait_for_link(world, "CONNECTED")
    state = world.states.wait_for_next(lambda s: s.valid == ALL_VALID)
    stamps = [s.header.stamp.to_sec() for s in world.states.messages if s.epoch == state.epoch]
    assert np.all(np.diff(stamps) > 0)


@both_transports
def test_bad_network(world, rx):
    world.emulator(*KINEMATIC, "--fault", "drop=0.05,dup=0.05,reorder=0.05,truncate=0.02,jitter=5ms")
    rx()
    states = world.states.wait_for_count(300, 60.0)
    stamps = [state.header.stamp.to_sec() for state in states]
    assert np.all(np.diff(stamps) > 0)
    assert {state.epoch for state in states} == {states[0].epoch}
    counts = [state.frame_count for state in states]
    assert counts == sorted(set(counts))


# --- leaving everything as it was -------------------------------------------------------------------------------------

ROW_3 = "sim/network/dataout/data_to_internet[3]"
ROW_21 = "sim/network/dataout/data_to_internet[21]"
ROW_133 = "sim/network/dataout/data_to_internet[133]"
RATE = "sim/network/dataout/network_data_rate"


@pytest.fixture
def users_data_output(world):
    """An X-Plane whose user has selected rows 3 and 133 at 33 Hz."""
    world.set_param("transport", "data")
    world.set_param("data_port", 0)
    emulator = world.emulator(*KINEMATIC)
    wire = world.wire(emulator.port)
    wire.send(protocol.RowSelection("DSEL", (3, 133)), protocol.DrefWrite(RATE, 33.0))
    wire.wait_until_reads(RATE, 33.0)
    wire.wait_until_reads(ROW_133, 1.0)
    return wire


@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "rosnode kill"])
def test_data_output_is_restored_at_the_end(world, rx, users_data_output, how):
    node = rx()
    world.states.wait_for()
    assert users_data_output.read(ROW_21) == 1.0
    assert users_data_output.read(RATE) == 99.0
    if how == "rosnode kill":
        with xmlrpc.client.ServerProxy(world.master.uri) as master:
            uri = master.lookupNode("/tests", f"{world.namespace}/rx_node")[2]
        with xmlrpc.client.ServerProxy(uri) as slave:
            slave.shutdown("/tests", "user request")
    else:
        node.send_signal(getattr(signal, how))
    assert node.wait(15) == 0
    # At once, not in the end: it was read back before the process ended.
    assert users_data_output.read(RATE) == 33.0
    assert users_data_output.read(ROW_3) == 1.0
    assert users_data_output.read(ROW_133) == 1.0
    assert users_data_output.read(ROW_21) == 0.0
    last = wait_for_link(world, "LOST")
    assert last.reason == "rx_node has stopped"
    assert not list(world.folder.glob("ros_home/xplane_bridge/*.json"))


def test_data_output_is_restored_at_the_next_start_after_a_crash(world, rx, users_data_output):
    node = rx()
    world.states.wait_for()
    assert users_data_output.read(ROW_21) == 1.0
    node.kill()
    assert users_data_output.read(ROW_21) == 1.0
    world.set_param("transport", "rref")
    rx()
    users_data_output.wait_until_reads(ROW_21, 0.0)
    users_data_output.wait_until_reads(RATE, 33.0)
    assert users_data_output.read(ROW_3) == 1.0


def test_nothing_is_touched_with_rref(world, rx, users_data_output):
    world.set_param("transport", "rref")
    node = rx()
    world.states.wait_for()
    assert users_data_output.read(ROW_21) == 0.0
    assert users_data_output.read(RATE) == 33.0
    node.send_signal(signal.SIGINT)
    assert node.wait(15) == 0


def test_nothing_is_configured_when_the_user_has_done_it(world, rx, users_data_output):
    port = free_udp_port()
    world.set_param("data_port", port)
    users_data_output.send(
        protocol.NetworkTarget(64, "127.0.0.1", port, True),
        protocol.RowSelection("DSEL", (1, 16, 17, 20, 21)),
    )
    users_data_output.wait_until_reads(ROW_21, 1.0)
    node = rx(configure_xplane=False)
    state = world.states.wait_for()
    assert state.valid != ALL_VALID
    assert state.latitude == pytest.approx(37.46, abs=0.5)
    assert users_data_output.read(RATE) == 33.0
    node.send_signal(signal.SIGINT)
    assert node.wait(15) == 0
    assert users_data_output.read(ROW_21) == 1.0


# --- parameters -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("params", "parts"),
    [
        ({"max_publsh_rate": 5}, ["max_publsh_rate", "did you mean max_publish_rate?"]),
        ({"rates": {"engine": 5}}, ["rates/engine", "did you mean engines?"]),
        ({"rates": {"flight": 0}}, ["rates/flight is 0", "from 1 to 1000"]),
        ({"position_source": "gps"}, ['"gps"', "one of: auto, local, rpos, xpc, float32"]),
        ({"origin": {"latitude": 10.0}}, ["origin/longitude is required"]),
        ({"datarefs": [{"name": "paused"}]}, ["datarefs[0]/name", "sim/cockpit2/controls/flap_ratio"]),
        ({"datarefs": [{"name": "sim/a[0:3]", "topic": "a"}]}, ["datarefs[0]/topic", "a scalar topic carries one"]),
        ({"datarefs": [{"name": "sim/a", "hz": 3}]}, ["datarefs[0]/hz"]),
        ({"host": "127.0.0.1"}, ["rx_node/host"]),
        ({"extra_rows": [3.5]}, ["extra_rows", "row numbers"]),
    ],
)
def test_wrong_parameters_are_refused_in_words(world, rx, params, parts):
    world.point_to(free_udp_port())
    node = rx(**params)
    assert node.wait(15) == 1
    for part in parts:
        assert part in node.output()


def test_a_port_in_use_is_said(world, rx):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 0))
        world.point_to(free_udp_port())
        world.set_param("transport", "data")
        world.set_param("data_port", other.getsockname()[1])
        node = rx()
        assert node.wait(15) == 1
    assert "in use" in node.output()


def test_diagnostics_cover_every_concern(world, rx):
    world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for_count(60)
    for name in ("link to X-Plane", "flight state", "clock", "position", "physics", "mission state"):
        status = world.wait_for_diagnostics(name, lambda s: s.level == 0, 30.0)
        assert status.values
    wait_until(
        lambda: world.values_of(world.wait_for_diagnostics("position"))["Source"].startswith(
            "scenery coordinates, agree"
        ),
        30.0,
        "comparison with RPOS",
    )
