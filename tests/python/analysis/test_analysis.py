"""The analysis core against flights whose numbers are known in closed form."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from xplane_bridge.analysis.consistency import GRAVITY, check_flight
from xplane_bridge.analysis.decimation import min_max
from xplane_bridge.analysis.episodes import Episode, from_sets, from_values
from xplane_bridge.analysis.quality import BAD_QUALITY, QUALITY_WORDS, bit_shares, joined, pace, pairing, timing
from xplane_bridge.analysis.summary import distance, summary

S = 10**9


def turn(rate: float = 100.0, seconds: float = 20.0) -> dict:
    """A steady level turn: bank 30 deg, 60 m/s, wind 5 m/s to the east; all by hand.

    Turn rate g tan(30 deg) / V = 0.09436 rad/s; in the body p = 0, q = Omega sin(bank), r = Omega cos(bank); specific
    force (0, 0, -g / cos(bank)); velocity over ground = air velocity + wind.
    """
    bank, speed = np.radians(30.0), 60.0
    omega = GRAVITY * np.tan(bank) / speed
    t = np.arange(round(seconds * rate)) / rate
    psi = omega * t
    ones = np.ones_like(t)
    half_roll, half_psi = bank / 2, psi / 2
    return {
        "sim_time_unwrapped": t,
        "orientation.w": np.cos(half_roll) * np.cos(half_psi),
        "orientation.x": np.sin(half_roll) * np.cos(half_psi),
        "orientation.y": np.sin(half_roll) * np.sin(half_psi),
        "orientation.z": np.cos(half_roll) * np.sin(half_psi),
        "angular_velocity.x": 0 * t,
        "angular_velocity.y": ones * omega * np.sin(bank),
        "angular_velocity.z": ones * omega * np.cos(bank),
        "velocity_ned.x": speed * np.cos(psi),
        "velocity_ned.y": speed * np.sin(psi) + 5.0,
        "velocity_ned.z": 0 * t,
        "wind_ned.x": 0 * t,
        "wind_ned.y": 5.0 * ones,
        "wind_ned.z": 0 * t,
        "specific_force.x": 0 * t,
        "specific_force.y": 0 * t,
        "specific_force.z": -ones * GRAVITY / np.cos(bank),
        "true_airspeed": speed * ones,
        "altitude_msl": 1000.0 * ones,
        "ground_speed": np.hypot(speed * np.cos(psi), speed * np.sin(psi) + 5.0),
    }


def checks(columns: dict) -> dict:
    count = len(columns["sim_time_unwrapped"])
    return {c.name: c for c in check_flight(columns, [slice(0, count)])}


def test_a_healthy_turn_raises_no_alarm() -> None:
    for check in checks(turn()).values():
        assert check.ok, check
        assert check.samples > 1000
        assert check.error < 0.01 * max(check.limit, 1e-9) + 1e-3


def swap(columns: dict, a: str, b: str) -> dict:
    return {**columns, a: columns[b], b: columns[a]}


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        (lambda c: swap(c, "angular_velocity.x", "angular_velocity.y"), "attitude against p, q, r"),
        (lambda c: {**c, "angular_velocity.z": np.degrees(c["angular_velocity.z"])}, "attitude against p, q, r"),
        (lambda c: {**c, "specific_force.z": -c["specific_force.z"]}, "specific force against dv/dt"),
        (lambda c: swap(c, "specific_force.y", "specific_force.z"), "specific force against dv/dt"),
        (lambda c: {**c, "wind_ned.y": -c["wind_ned.y"]}, "|velocity - wind| against true airspeed"),
        (lambda c: {**c, "velocity_ned.z": c["velocity_ned.z"] + 3.0}, "climb against -v_down"),
    ],
)
def test_each_fault_is_named(fault: object, name: str) -> None:
    found = checks(fault(turn()))
    assert not found[name].ok, found[name]


def test_checks_do_not_cross_a_reset() -> None:
    columns = turn()
    jumped = {**columns, "altitude_msl": columns["altitude_msl"] + np.where(np.arange(2000) >= 1000, 500.0, 0.0)}
    climb = check_flight(jumped, [slice(0, 1000), slice(1000, 2000)])[3]
    assert climb.ok
    assert climb.samples == 1998


def test_missing_values_leave_nothing_to_compare() -> None:
    columns = turn()
    nan = {**columns, "true_airspeed": np.full(2000, np.nan)}
    check = checks(nan)["|velocity - wind| against true airspeed"]
    assert (check.samples, check.ok) == (0, True)


@pytest.mark.parametrize("rows", [slice(0, 1), slice(0, 0)])
def test_one_state_or_none_leaves_nothing_to_compare(rows: slice) -> None:
    columns = {name: values[rows] for name, values in turn().items()}
    found = {c.name: c.samples for c in check_flight(columns, [rows] if rows.stop else [])}
    assert sum(found.values()) == found["|velocity - wind| against true airspeed"] == rows.stop


def test_pace_is_of_frames_that_were_flown_by_the_speed_that_was_asked_for() -> None:
    """1 s in real time at 50 frames/s, a pause of 1 s, 1 s in 2 s at 25, a gap, 2 s in 1 s as asked."""
    sim = np.concatenate([np.arange(51) / 50, np.full(50, 1.0), 1.0 + np.arange(1, 51) / 50, 9.0 + np.arange(51) / 25])
    host = np.concatenate([np.arange(101) / 50, 2.0 + np.arange(1, 51) / 25, 6.0 + np.arange(51) / 50])
    time, asked = np.round(host * S).astype(np.int64), np.where(np.arange(202) < 151, 1.0, 2.0)
    state = {"sim_time_unwrapped": sim, "frame_period": np.full(202, 0.02), "paused": (np.arange(202) // 50 == 1)}
    found = pace(time, state, [slice(0, 151), slice(151, 202)], asked)
    assert (found.host, found.simulated) == (pytest.approx(4.0, abs=0.1), pytest.approx(3.0, abs=0.1))
    assert (found.slowest, found.fastest) == (pytest.approx(25.0), pytest.approx(50.0))
    assert found.factor == pytest.approx(4 / 3, abs=0.02)
    unknown = pace(time, {**state, "frame_period": np.full(202, np.nan)}, [slice(0, 202)], asked)
    assert np.isnan(unknown.slowest)


def test_timing_counts_gaps_and_jitter() -> None:
    time = np.array([0, 10, 20, 30, 90, 100, 112, 108], dtype=np.int64) * 1_000_000
    got = timing(time)
    assert (got.count, got.gaps, got.backward) == (8, 1, 1)
    assert got.longest_gap == pytest.approx(0.06)
    assert got.period == pytest.approx(0.01)
    assert got.rate == pytest.approx(7 / 0.108)
    # periods without the gap: 10, 10, 10, 10, 12, -4 ms: mean 8, variance (4*4 + 16 + 144) / 6
    assert got.jitter == pytest.approx(np.sqrt((4 * 4 + 16 + 144) / 6) * 1e-3)
    assert timing(time[:1]).count == 1
    assert np.isnan(timing(time[:1]).rate)


def test_every_bit_of_an_image_has_words() -> None:
    message = (Path(__file__).parents[3] / "msg" / "FrameState.msg").read_text(encoding="utf-8")
    assert set(QUALITY_WORDS) == set(re.findall(r"^uint32 QUALITY_(\w+) *=", message, re.MULTILINE))
    assert {name[len("QUALITY_") :] for name in BAD_QUALITY} <= set(QUALITY_WORDS)


def test_bit_shares_take_single_bits_only() -> None:
    constants = {"VALID_A": 1, "VALID_B": 2, "VALID_ALL": 3, "OTHER": 4}
    assert bit_shares(np.array([1, 3, 0, 2], dtype=np.uint32), constants, "VALID_") == {"A": 0.5, "B": 0.5}


BITS = {"QUALITY_STATE_MISSING": 1, "QUALITY_DISPLAY_UNKNOWN": 8, "QUALITY_FROZEN": 32}


def frames(quality: list, **columns: list) -> dict:
    """Columns of frame_state; counters that are not given stay 0, as do time errors."""
    zeros = {name: [0] * len(quality) for name in ("sim_time_error", "dropped", "frozen", "unpaired")}
    return {name: np.array(values) for name, values in {**zeros, "quality": quality, **columns}.items()}


def test_pairing_numbers() -> None:
    got = pairing(frames([0, 0, 1, 8], sim_time_error=[0.0, -0.002, np.nan, 0.004]), BITS)
    assert (got.images, got.perfect, got.with_state) == (4, 0.5, 0.75)
    assert (got.error_p50, got.error_max) == pytest.approx((0.002, 0.004))


def test_pictures_lost_before_the_recording_are_not_counted() -> None:
    # The node had run for long: 70 dropped, 5 frozen, 9 unpaired before the recording. Its first image is frozen and
    # has no state, which the counters have in them already.
    quality = [33, 32, 0, 1]
    got = pairing(frames(quality, dropped=[70, 70, 73, 73], frozen=[6, 7, 7, 7], unpaired=[10, 10, 10, 11]), BITS)
    assert (got.dropped, got.frozen, got.unpaired) == (3, 2, 2)


def test_counters_go_on_over_a_restart_of_the_node() -> None:
    # 2 more before the restart, then 4 from zero, of which the last image brought 3.
    got = pairing(frames([0] * 4, dropped=[70, 72, 1, 4], frozen=[5, 5, 0, 0], unpaired=[3, 3, 0, 0]), BITS)
    assert (got.dropped, got.frozen, got.unpaired) == (6, 0, 0)


def test_distance_is_the_integral_inside_segments() -> None:
    time = np.array([0.0, 1.0, 2.0, 10.0, 11.0])
    speed = np.array([10.0, 20.0, 20.0, 4.0, 6.0])
    assert distance(time, speed, [slice(0, 3), slice(3, 5)]) == pytest.approx(15 + 20 + 5)


def test_summary_takes_distance_by_the_time_of_the_simulator() -> None:
    columns = {"ground_speed": np.array([60.0, 60.0]), "sim_time_unwrapped": np.array([7.0, 8.0])}
    found = {q.name: q.value for q in summary(np.array([0, 2]) * S, columns, [slice(0, 2)])}
    assert found["distance over ground"] == pytest.approx(60.0)


def test_summary_names_extremes_with_units() -> None:
    time = np.array([0, 1]) * S
    got = summary(time, {"roll_deg": np.array([-20.0, 31.0]), "alpha_deg": np.array([np.nan, np.nan])}, [slice(0, 2)])
    assert [(q.name, q.value, q.unit) for q in got] == [
        ("duration", 1.0, "s"),
        ("lowest roll", -20.0, "deg"),
        ("highest roll", 31.0, "deg"),
    ]


def test_episodes_from_latched_values_and_sets() -> None:
    time = np.array([10, 20, 30, 40])
    assert from_values(time, ["auto", "auto", "", "manual"], 99) == [Episode(10, 30, "auto"), Episode(40, 99, "manual")]
    got = from_sets(time, [["a"], ["a", "b"], ["b"], []], 99)
    assert got == [Episode(10, 30, "a"), Episode(20, 40, "b")]
    assert from_sets(time[:1], [["a"]], 99) == [Episode(10, 99, "a")]


def test_decimation_keeps_every_peak() -> None:
    time = np.arange(100_000.0)
    values = np.sin(time / 500)
    values[77_777] = 9.0
    values[12_345] = -9.0
    t, v = min_max(time, values, 1000)
    assert len(v) <= 1000
    assert (v.max(), v.min()) == (9.0, -9.0)
    assert (np.diff(t) > 0).all()
    short = min_max(time[:10], values[:10], 1000)
    assert len(short[0]) == 10
    gap = values.copy()
    gap[40_000:60_000] = np.nan
    assert np.isnan(min_max(time, gap, 1000)[1]).any()


def test_decimation_keeps_lines_broken() -> None:
    time = np.arange(100_000.0)
    heading = (time * 0.01) % 360.0  # wraps 2 times, and 200 samples make a run
    heading[1:][np.diff(heading) < 0] = np.nan
    kept = min_max(time, heading, 1000)[1]
    assert np.nanmax(np.abs(np.diff(kept))) < 180.0
    assert np.isnan(kept).sum() == 2
    short = np.where((time > 50_010) & (time < 50_020), np.nan, 7.0)
    t, v = min_max(time, short, 1000)
    assert t[np.isnan(v)].tolist() == [50_011.0]
    assert np.isnan(min_max(time, np.full(100_000, np.nan), 1000)[1]).all()


def keyed(*pictures: tuple) -> dict:
    """FrameStates of pictures: epoch, simulator time of the frame, quality."""
    epoch, time, quality = zip(*pictures)
    columns = {"state.epoch": np.array(epoch, dtype=np.uint32), "frame_sim_time": np.array(time)}
    return {**columns, "quality": np.array(quality, dtype=np.uint32)}


def test_pictures_of_several_cameras_join_by_the_frame_they_show() -> None:
    # After a reset of the simulator (epoch 2) its time comes again; the paused picture has no frame, one has no state.
    ahead = keyed((1, 0.1, 0), (1, 0.2, 32), (1, 0.3, 0), (1, np.nan, 128), (2, 0.1, 0), (2, 0.2, 1), (2, 0.3, 0))
    down = keyed((1, 0.2, 0), (1, 0.3, 0), (1, 0.3, 0), (1, np.nan, 128), (2, 0.2, 1), (2, 0.3, 0), (2, 0.4, 0))
    got = joined([ahead, down], BITS)
    assert got[:4] == ((5, 4), 6, 3, 2)
    assert [rows.tolist() for rows in got.rows] == [[1, 2, 6], [0, 1, 5]]
    tail = keyed((1, 0.3, 0))
    assert [rows.tolist() for rows in joined([ahead, down, tail], BITS).rows] == [[2], [1], [0]]
    assert joined([ahead, keyed((1, np.nan, 1))], BITS)[:4] == ((5, 0), 5, 0, 0)
