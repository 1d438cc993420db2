"""The checks of a recorded flight: each passes a good flight and finds the fault it is there for."""

import math

import numpy as np
import pytest

from xplane_bridge.bags import Table
from xplane_bridge.harness import flight_check
from xplane_bridge.harness.flight_check import CheckError

RATE = 50.0
COUNT = 251  # 5 s


def states(**changed):
    """Five seconds at 50 Hz, 60 m/s north from 37.5 N at 1000 m: columns as a bag's FlightState has them."""
    t = np.arange(COUNT) / RATE
    columns = {
        "header.stamp": (1_700_000_000 + t) * 1e9,
        "sim_time": (100.0 + t).astype(np.float32),
        "sim_time_unwrapped": 100.0 + t,
        "epoch": np.full(COUNT, 3, dtype=np.uint32),
        "valid": np.full(COUNT, 0b111, dtype=np.uint32),
        "latitude": 37.5 + np.degrees(60.0 * t / (6378145.0 + 1000.0)),
        "longitude": np.full(COUNT, 127.0),
        "altitude_msl": np.full(COUNT, 1000.0),
        "roll_deg": np.zeros(COUNT),
    }
    columns["header.stamp"] = columns["header.stamp"].astype(np.int64)
    columns.update(changed)
    return Table("/xplane/flight_state", "xplane_bridge/FlightState", columns["header.stamp"], columns)


def truth(table):
    """What the emulator would have written for such a flight."""
    names = {
        "sim_time": "sim_time",
        "latitude_deg": "latitude",
        "longitude_deg": "longitude",
        "altitude_m": "altitude_msl",
    }
    return {theirs: np.array(table[ours]) for theirs, ours in names.items()}


def odom(velocity_error=0.0, tilt=True):
    """A level turn at 60 m/s, 3 deg/s, with 2 m/s of climb, exact; twist in body axes (FLU) of a banked aircraft."""
    t = np.arange(COUNT) / RATE
    rate = math.radians(3.0)
    course = rate * t  # from east to north, as ENU angles count
    east, north = 60.0 / rate * np.sin(course), 60.0 / rate * (1.0 - np.cos(course))
    bank = math.radians(20.0) if tilt else 0.0
    # q = Rz(course) * Rx(bank), Hamilton product, (x, y, z, w).
    cz, sz, cx, sx = np.cos(course / 2), np.sin(course / 2), math.cos(bank / 2), math.sin(bank / 2)
    quaternion = {"x": cz * sx, "y": sz * sx, "z": sz * cx, "w": cz * cx}
    # Velocity in the axes before the bank is (60, 0, 2); turned back by the bank about x.
    twist = {
        "x": np.full(COUNT, 60.0 + velocity_error),
        "y": np.full(COUNT, 2.0 * math.sin(bank)),
        "z": np.full(COUNT, 2.0 * math.cos(bank)),
    }
    columns = {"header.stamp": ((1_700_000_000 + t) * 1e9).astype(np.int64)}
    columns.update({f"pose.pose.position.{k}": v for k, v in zip("xyz", (east, north, 2.0 * t))})
    columns.update({f"pose.pose.orientation.{k}": v for k, v in quaternion.items()})
    columns.update({f"twist.twist.linear.{k}": v for k, v in twist.items()})
    return Table("/xplane/odom", "nav_msgs/Odometry", columns["header.stamp"], columns)


def test_a_good_flight_passes_every_check():
    table = states()
    verdicts = [
        flight_check.check_validity(table, 0b111),
        flight_check.check_numbers(table),
        flight_check.check_stamps(table),
        flight_check.check_rate(table, truth(table)),
        flight_check.check_positions(table, truth(table)),
        flight_check.check_odometry(odom(), table),
    ]
    assert [verdict for verdict in verdicts if not verdict.passed] == []


def test_a_cleared_validity_bit_is_named():
    valid = np.full(COUNT, 0b111, dtype=np.uint32)
    valid[17] = 0b101
    verdict = flight_check.check_validity(states(valid=valid), 0b111)
    assert not verdict.passed
    assert "1 of 251" in verdict.text
    assert verdict.text.endswith("bits 2")


def test_a_nan_is_found_and_named():
    roll = np.zeros(COUNT)
    roll[[3, 9]] = np.nan
    verdict = flight_check.check_numbers(states(roll_deg=roll))
    assert not verdict.passed
    assert "roll_deg (2)" in verdict.text


def test_a_stamp_that_stands_still_is_found_unless_a_new_epoch_begins():
    stamp = states()["header.stamp"].copy()
    stamp[100] = stamp[99]
    epoch = np.full(COUNT, 3, dtype=np.uint32)
    changed = {"header.stamp": stamp}
    assert not flight_check.check_stamps(states(**changed)).passed
    epoch[100:] = 4
    assert flight_check.check_stamps(states(**changed, epoch=epoch)).passed


@pytest.mark.parametrize(
    ("passed", "judged", "word"), [(True, True, "ok"), (False, True, "FAILED"), (True, False, "skipped")]
)
def test_what_was_not_judged_is_not_called_ok(passed, judged, word):
    verdict = flight_check.Verdict("failure", passed, "why", judged)
    assert verdict.line.split() == [word, "failure", "why"]


@pytest.mark.parametrize(("lost", "passed"), [(4, True), (6, False)])
def test_more_than_two_per_cent_of_lost_frames_fail(lost, passed):
    whole = states()
    kept = np.ones(COUNT, dtype=bool)
    kept[50 : 50 + lost] = False
    table = states(**{name: column[kept] for name, column in whole.columns.items()})
    assert flight_check.check_rate(table, truth(whole)).passed is passed


@pytest.mark.parametrize(
    ("column", "amount"),
    # 15 mm each: on the sphere of 6 379 145 m (1000 m up), and for longitude on the parallel of 37.5 degrees.
    [
        ("latitude", math.degrees(0.015 / 6379145.0)),
        ("longitude", math.degrees(0.015 / (6379145.0 * math.cos(math.radians(37.5))))),
        ("altitude_msl", 0.015),
    ],
)
def test_a_position_off_by_15_mm_fails_and_by_7_mm_passes(column, amount):
    table = states()
    for share, passed in ((1.0, False), (7.0 / 15.0, True)):
        moved = table[column].copy()
        moved[200] += amount * share
        verdict = flight_check.check_positions(states(**{column: moved}), truth(table))
        assert verdict.passed is passed
        assert f"{15.0 * share:.1f} mm" in verdict.text


def test_a_state_of_another_frame_fails_even_where_positions_are_alike():
    sim_time = states()["sim_time"].copy()
    sim_time[40] += np.float32(0.003)
    verdict = flight_check.check_positions(states(sim_time=sim_time), truth(states()))
    assert not verdict.passed


@pytest.mark.parametrize(("error", "passed"), [(0.0, True), (0.015, True), (0.03, False)])
def test_a_twist_that_position_does_not_follow_fails(error, passed):
    assert flight_check.check_odometry(odom(velocity_error=error), states()).passed is passed


def test_a_twist_given_in_the_wrong_axes_fails():
    table = odom()
    for axis in "xyz":
        table.columns[f"pose.pose.orientation.{axis}"] = -table.columns[f"pose.pose.orientation.{axis}"]
    assert not flight_check.check_odometry(table, states()).passed


def test_odometry_with_gaps_only_is_no_proof():
    table = odom()
    table.columns["header.stamp"] = table.columns["header.stamp"] + np.arange(COUNT) * int(2e9)
    verdict = flight_check.check_odometry(
        table, states(**{"header.stamp": table.stamp, "sim_time_unwrapped": table.stamp / 1e9})
    )
    assert not verdict.passed
    assert "without a gap" in verdict.text


def test_a_file_that_is_no_truth_is_refused(tmp_path):
    path = tmp_path / "truth.csv"
    path.write_text("frame,sim_time\n1,2.0\n", encoding="utf-8")
    with pytest.raises(CheckError, match="latitude"):
        flight_check.read_truth(path)
    with pytest.raises(CheckError, match="No such file"):
        flight_check.read_truth(tmp_path / "none.csv")


def test_the_table_shows_rate_gaps_and_ends():
    table = states()
    table.time[120:] += int(0.1e9)
    line = flight_check.summarise_table(table)
    assert line.count == COUNT
    assert line.rate == pytest.approx(250 / 5.1)
    assert line.gaps == 1
    assert line.longest == pytest.approx(0.12)
    assert "alt 1000" in line.first
    assert "alt 1000" in flight_check.render([line])


def test_odometry_is_judged_in_simulator_time():
    slow = 1_700_000_000 * 10**9 + np.arange(COUNT) * 30_000_000  # 20 ms of the simulator took 30 ms
    table = odom()
    table.columns["header.stamp"] = slow
    assert flight_check.check_odometry(table, states(**{"header.stamp": slow})).passed
    assert not flight_check.check_odometry(table, states()).passed  # nearly no message is of a frame that is known
