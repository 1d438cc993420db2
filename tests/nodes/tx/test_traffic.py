"""Other aircraft through the nodes: what X-Plane has, and what is placed in it."""

from __future__ import annotations

import math
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.rx_fixtures import ALL_VALID
from support.nodes.tx_fixtures import WatchedDatarefs, tx_params
from support.stretches import last_stretch
from xplane_bridge.bags import Bags
from xplane_bridge.harness import wait_until
from xplane_bridge.resources import config_file, program

EARTH_RADIUS_M = 6378145.0
LATITUDE, LONGITUDE = 37.4602, 126.4407
TIME = "sim/time/total_running_time_sec"
OVERRIDE3 = "sim/operation/override/override_planepath[3]"
IN_A_ROW = 120  #: states of four seconds, at 30 frames a second
KINEMATIC = ("--model", "kinematic", "--lat", LATITUDE, "--lon", LONGITUDE)


@pytest.mark.parametrize("version", ["11.40", "11", "12"])
def test_other_aircraft_are_published_where_they_are_at_their_time(world, version):
    from xplane_bridge.msg import TrafficState

    emulator = world.emulator(*KINEMATIC, "--version", version, "--traffic", 2)
    world.start("rx_node", {"rates": {"traffic": 50}})
    traffic = world.watch("traffic/state", TrafficState)
    first = traffic.wait_for(lambda state: len(state.number) == 2, WAIT_S, "two aircraft")
    last = traffic.wait_for(lambda state: state.sim_time > first.sim_time + 2.0, WAIT_S, "two seconds more")
    assert emulator.port
    assert list(last.number) == [1, 2]
    for state in (first, last):
        for i, number in enumerate(state.number):
            # Where the emulator lets them fly: ahead, to the right and above; north with 60 m/s since its start.
            north = 1500.0 + 300.0 * number + 60.0 * state.sim_time
            east = 150.0 * number
            assert state.latitude[i] - LATITUDE == pytest.approx(math.degrees(north / EARTH_RADIUS_M), abs=2e-6)
            across = EARTH_RADIUS_M * math.cos(math.radians(LATITUDE))
            assert state.longitude[i] - LONGITUDE == pytest.approx(math.degrees(east / across), abs=1e-6)
            assert state.altitude_msl[i] == pytest.approx(1000.0 + 30.0 * number, abs=0.05)
            assert abs(math.remainder(state.heading_true_deg[i], 360.0)) < 0.01
            assert (state.roll_deg[i], state.pitch_deg[i]) == pytest.approx((0.0, 0.0), abs=0.01)
            velocity = (state.velocity_north[i], state.velocity_east[i], state.velocity_down[i])
            assert velocity == pytest.approx((60.0, 0.0, 0.0), abs=0.01)
            assert 1000.0 < state.tcas_distance[i] < 4000.0
            assert 0.0 < state.tcas_bearing_deg[i] < 15.0
            codes = (0, 0) if version == "11.40" else (0x710000 + number, 2000 + number)
            assert (state.mode_s_id[i], state.transponder_code[i]) == codes
    assert last.header.stamp > first.header.stamp
    assert last.epoch == first.epoch


def subscriptions(emulator):
    return sum(emulator.status()["subscriptions"].values())


def settled_subscriptions(emulator):
    """Their number once it has stood for three seconds: they are asked for little by little."""
    numbers = []

    def look():
        numbers.append(subscriptions(emulator))
        time.sleep(0.1)
        return numbers[-1] > 0 and numbers[-30:] == [numbers[-1]] * 30

    wait_until(look, WAIT_S, "settled number of subscriptions")
    return numbers[-1]


def test_nothing_is_asked_for_without_a_subscriber(world):
    from xplane_bridge.msg import FlightState, TrafficState

    emulator = world.emulator(*KINEMATIC, "--traffic", 1)
    states = world.watch("flight_state", FlightState)
    world.start("rx_node")
    states.wait_for(lambda state: state.valid == ALL_VALID, what="a complete state")
    quiet = settled_subscriptions(emulator)
    log = world.watch("traffic/state", TrafficState)
    log.wait_for(lambda state: list(state.number) == [1], WAIT_S, "the other aircraft")
    wait_until(lambda: subscriptions(emulator) >= quiet + 19 * 12, WAIT_S, "subscriptions for 19 aircraft")
    log.close()
    wait_until(lambda: subscriptions(emulator) == quiet, WAIT_S, "the subscription's end")


def command_of(number, now, **more):
    """An aircraft that flies north from 2 km north of the start with 50 m/s, as it is `now` [s] after its begin."""
    from xplane_bridge.msg import TrafficCommand

    latitude = LATITUDE + math.degrees((2000.0 + 50.0 * now) / EARTH_RADIUS_M)
    fields = {
        "number": [number],
        "latitude": [latitude],
        "longitude": [LONGITUDE],
        "altitude_msl": [900.0],
        "roll_deg": [10.0],
        "pitch_deg": [2.0],
        "heading_true_deg": [0.0],
        "velocity_north": [50.0],
        "velocity_east": [0.0],
        "velocity_down": [0.0],
    }
    return TrafficCommand(**{**fields, **more})


@pytest.fixture(name="placed")
def fixture_placed(world):
    """Starts both nodes and commands aircraft 3 at 5 Hz, by simulator time, until it is stopped."""
    import rospy
    from xplane_bridge.msg import TrafficCommand, TrafficState

    ended = threading.Event()
    clocks = []  # X-Plane's own: a state may have waited in this process

    def start(*options, **params):
        emulator = world.emulator("--aircraft", "fixed_wing", "--lat", LATITUDE, "--lon", LONGITUDE, *options)
        world.set_param("aircraft", "fixed_wing")
        world.start("rx_node", {"rates": {"traffic": 60}})
        # A busy machine's commands may be silent for a moment.
        tx = world.start("tx_node", tx_params(**{"traffic_timeout": 10.0, **params}))
        world.traffic = world.watch("traffic/state", TrafficState)
        clocks.append(WatchedDatarefs(emulator.port, TIME))
        wait_until(lambda: not math.isnan(clocks[0].value(TIME)), WAIT_S, TIME)
        world.begin = clocks[0].value(TIME)
        publisher = rospy.Publisher(f"{world.namespace}/traffic/command", TrafficCommand, queue_size=1)
        wait_until(lambda: publisher.get_num_connections() > 0, WAIT_S, "tx_node's subscription")

        def fly():
            while not ended.wait(0.2):
                publisher.publish(command_of(3, clocks[0].value(TIME) - world.begin))

        world.flying = threading.Thread(target=fly, daemon=True)
        world.flying.start()
        world.publisher = publisher
        return emulator, tx

    def stop():
        ended.set()
        if world.flying:
            world.flying.join()

    world.flying = None
    start.stop = stop
    yield start
    stop()
    for clock in clocks:
        clock.close()


@pytest.mark.parametrize("way", ["written", "vehx"])
def test_a_commanded_aircraft_flies_smoothly_and_is_given_back(world, placed, way):
    emulator, _ = placed(traffic_way=way)

    def seen():
        """Without the first, which may be of a frame in the middle of the first nine writes."""
        return [state for state in world.traffic.messages[:] if 3 in list(state.number)][1:]

    def keeps_up(state):
        north = math.radians(state.latitude[list(state.number).index(3)] - LATITUDE) * EARTH_RADIUS_M
        return abs(2000.0 + 50.0 * (state.sim_time - world.begin) - north - 10.0) <= 25.0

    wait_until(lambda: last_stretch(map(keeps_up, seen()), IN_A_ROW), 2 * WAIT_S, "four seconds of smooth flight")
    for state in seen():
        i = list(state.number).index(3)
        assert state.altitude_msl[i] == pytest.approx(900.0, abs=0.1)
        assert state.roll_deg[i] == pytest.approx(10.0, abs=0.05)
        if way == "written":
            assert state.velocity_north[i] == pytest.approx(50.0, abs=0.05)
    wire = world.wire(emulator.port)
    assert wire.read(OVERRIDE3) == 1.0
    placed.stop()
    wire.wait_until_reads(OVERRIDE3, 0.0)


def test_it_is_given_back_when_tx_node_ends_and_when_it_is_killed(world, placed):
    emulator, tx = placed()
    wire = world.wire(emulator.port)
    wire.wait_until_reads(OVERRIDE3, 1.0)
    tx.kill()
    wire.wait_until_reads(OVERRIDE3, 0.0)  # by the guardian
    tx = world.start("tx_node", tx_params(traffic_timeout=10.0))
    wire.wait_until_reads(OVERRIDE3, 1.0)
    tx.stop()
    assert wire.read(OVERRIDE3) == 0.0


def test_a_wrong_list_is_refused_in_words(world, placed):
    _, tx = placed()
    world.traffic.wait_for(lambda state: 3 in list(state.number), WAIT_S, "aircraft 3")
    placed.stop()
    world.publisher.publish(command_of(3, 0.0, latitude=[]))
    tx.wait_for_line("traffic/command is refused: latitude has 0 elements: expected 1, as `number`", WAIT_S)


def test_the_conflict_scenario_is_recorded_with_the_truth_of_both(tmp_path):
    done = subprocess.run(
        [
            sys.executable,
            str(program("run_scenario")),
            str(config_file("scenarios", "conflict.yaml")),
            "--output",
            str(tmp_path),
        ],
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (bag,) = tmp_path.glob("*.bag")
    with Bags(bag) as bags:
        own = bags.read("/xplane/flight_state", ["sim_time", "latitude", "longitude", "altitude_msl"])
        traffic = bags.read("/xplane/traffic/state", ["sim_time", "number", "latitude", "longitude", "altitude_msl"])
    distances = []
    for i, sim_time in enumerate(traffic["sim_time"]):
        numbers = list(traffic["number"][i])
        if 1 not in numbers or traffic["altitude_msl"][i][numbers.index(1)] < 500.0:
            continue  # parked, before its begin
        at = numbers.index(1)
        nearest = int(np.argmin(np.abs(own["sim_time"] - sim_time)))
        north = math.radians(traffic["latitude"][i][at] - own["latitude"][nearest]) * EARTH_RADIUS_M
        east = math.radians(traffic["longitude"][i][at] - own["longitude"][nearest]) * EARTH_RADIUS_M
        distances.append(math.hypot(north, east * math.cos(math.radians(LATITUDE))))
    assert max(distances) == pytest.approx(math.hypot(2400.0, 2400.0), rel=0.05), "where it begins"
    assert 150.0 < min(distances) < 1500.0, "they meet, but for the turn"
