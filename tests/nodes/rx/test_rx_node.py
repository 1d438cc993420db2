"""rx_node against X-Plane's stand-in: what it publishes, what it refuses and what it says of itself."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import re
import socket

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.rx_fixtures import (  # noqa: F401
    ALL_VALID,
    EARTH_RADIUS_M,
    KINEMATIC,
    both_transports,
    fixture_rx,
    fixture_transport,
)
from xplane_bridge import __version__, protocol
from xplane_bridge.harness import wait_until
from xplane_bridge.harness.ports import free_udp_port
from xplane_bridge.resources import config_file

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
    wait_until(lambda: odoms.connected and imus.connected and fixes.connected, WAIT_S, "connections")
    # Topics are connected one after the other: from the first message of odometry on each state has one.
    began = odoms.wait_for().header.stamp

    def with_odometry(states):
        return [state for state in states if state.header.stamp >= began]

    wait_until(lambda: len(with_odometry(world.states.messages[:])) >= 610, 2 * WAIT_S, "states with odometry")
    link = world.links.wait_for(lambda m: m.state_name == "CONNECTED" and m.xplane_version, WAIT_S)  # not STALE of late
    assert link.transport == transport
    assert link.xplane_version // 10000 == version
    states = world.states.messages[:]
    emulator.stop()
    if transport == "data":  # what comes by dataref is unknown at first where a busy simulator was silent for a second
        gaps = [(late.header.stamp - early.header.stamp).to_sec() for early, late in zip(states, states[1:])]
        behind = {at + 1 + frames for at, gap in enumerate(gaps) if gap > 0.9 for frames in range(3)}
        states = [state for number, state in enumerate(states) if number not in behind]

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

    states = with_odometry(states)
    assert len(states) >= 600
    odoms.wait_for(lambda odom: odom.header.stamp == states[-1].header.stamp)
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

    state = states[-100]
    fix = fixes.wait_for(lambda fix: fix.header.stamp == state.header.stamp)
    assert (fix.latitude, fix.longitude) == (state.latitude, state.longitude)
    assert fix.altitude == state.altitude_msl
    imu = imus.wait_for(lambda imu: imu.header.stamp == state.header.stamp)
    assert imu.linear_acceleration.z == pytest.approx(-state.specific_force.z)


@both_transports
def test_mission_state_arrives_complete(world, rx):
    import xplane_bridge.msg

    world.emulator()
    logs = {group: world.watch(f"mission/{group}", getattr(xplane_bridge.msg, name)) for group, name in MISSION.items()}
    rx()
    for group, log in logs.items():
        everything = getattr(xplane_bridge.msg, MISSION[group]).VALID_ALL
        message = log.wait_for(lambda m, bits=everything: m.valid == bits, WAIT_S, "complete state")
        assert math.isfinite(message.sim_time)
        assert message.header.stamp.to_sec() > 1e9
    engines = logs["engines"].wait_for_next()
    assert engines.count == 2
    assert engines.engine_speed[0] > 500.0
    assert math.isnan(engines.engine_speed[2])
    surfaces = logs["surfaces"].wait_for_next()
    assert math.isfinite(surfaces.delta_aileron)


@both_transports
def test_a_slow_simulator_is_seen_by_a_state_a_second(world, rx):
    from xplane_bridge.msg import SimStatus

    world.emulator(*KINEMATIC, "--fps", 10)  # of each tenth of a second, a twentieth is simulated
    log = world.watch("mission/sim", SimStatus)
    rx(rates={"flight": 1}, data_output_rate=1)
    world.wait_for_diagnostics("clock", lambda s: s.level == 1 and "% of real time" in s.message, WAIT_S)
    log.wait_for(lambda m: abs(m.time_ratio - 0.5) < 0.05, WAIT_S, "half of real time")


def test_a_frame_split_over_datagrams_is_joined(world, rx):
    world.emulator(*KINEMATIC, "--rref-split", 40)
    rx()
    states = world.states.wait_for_count(100, WAIT_S)
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
    states = world.states.wait_for_count(40, WAIT_S)
    counts = np.diff([state.frame_count for state in states])
    each = 0.05 / np.median([state.frame_period for state in states])  # 3, but where frames are late
    assert abs(np.median(counts) - each) < 0.7
    assert np.mean(abs(counts - each) <= 1.5) >= 0.9, counts
    took = (states[-1].header.stamp - states[0].header.stamp).to_sec()
    assert took > 39 * 0.05 - 0.06, "more than 20 a second"


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
    first, *later = wind.wait_for_count(10)
    assert first.header.frame_id == "map"
    assert (first.twist.twist.linear.x, first.twist.twist.linear.y) == pytest.approx((10.0, 0.0), abs=0.01)
    periods = np.diff([message.header.stamp.to_sec() for message in (first, *later)])
    assert np.median(periods) == pytest.approx(0.2, abs=0.05)


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
        world.wait_for_diagnostics("link to X-Plane", lambda s: "sim/no/such_dataref" in s.message, WAIT_S)
    else:  # X-Plane then gives no way to distinguish it from a real zero
        values.wait_for(lambda message: message.values[0] == 0.0)
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
    rows.wait_for_count(20)
    states = {state.header.stamp for state in world.states.wait_for_count(20)}
    assert any(message.header.stamp in states for message in rows.messages), "stamped as the state of the same datagram"


# --- how it was made --------------------------------------------------------------------------------------------------


@both_transports
def test_the_passport_says_how_the_flight_is_made_and_changes_with_it(world, rx):
    from xplane_bridge.msg import Experiment

    emulator = world.emulator(*KINEMATIC)
    text = "name: fixed_wing\n"
    world.set_param("experiment", {"aircraft_file": text, "pilot": "Kim"})
    passports = world.watch("experiment", Experiment)
    rx(publish_tf=False)
    first = passports.wait_for(timeout=WAIT_S)
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
    passports.wait_for(lambda p: dict(zip(p.settings, p.setting_values))["sim/time/sim_speed"] == 2.0, WAIT_S)
    last = passports.wait_for(lambda p: "Lee" in p.parameters, WAIT_S)
    assert last.header.stamp > first.header.stamp
    assert len(passports.messages) <= 4


def test_the_passport_has_what_is_flown_and_no_secret(world, rx):
    from xplane_bridge.msg import Experiment

    world.emulator(*KINEMATIC)
    world.set_param("display_delay", 0.05)
    world.set_param("capture_node/sender", {"listen": ":49790", "token": "window seat"})
    passports = world.watch("experiment", Experiment)
    rx()
    first = json.loads(passports.wait_for(timeout=WAIT_S).parameters)
    assert first["capture_node"]["sender"] == {"listen": ":49790", "token": "..."}
    # As a launch file does that is started later in the namespace: rx_node keeps to what it has read.
    for key, value in {"display_delay": 0.0, "transport": "data", "tx_node/rate": 50}.items():
        world.set_param(key, value)
    last = json.loads(passports.wait_for(lambda p: "tx_node" in p.parameters, WAIT_S).parameters)
    assert last.pop("tx_node") == {"rate": 50}
    assert last == first
    assert first["display_delay"] == 0.05


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
    assert node.wait(WAIT_S) == 1
    for part in parts:
        assert part in node.output()


def test_a_port_in_use_is_said(world, rx):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 0))
        world.point_to(free_udp_port())
        world.set_param("transport", "data")
        world.set_param("data_port", other.getsockname()[1])
        node = rx()
        assert node.wait(WAIT_S) == 1
    assert "in use" in node.output()


def test_diagnostics_cover_every_concern(world, rx):
    world.emulator(*KINEMATIC)
    rx()
    world.states.wait_for_count(60)
    for name in ("link to X-Plane", "flight state", "clock", "position", "physics", "mission state"):
        status = world.wait_for_diagnostics(name, lambda s: s.level == 0, WAIT_S)
        assert status.values
    wait_until(
        lambda: world.values_of(world.wait_for_diagnostics("position"))["Source"].startswith(
            "scenery coordinates, agree"
        ),
        WAIT_S,
        "comparison with RPOS",
    )
