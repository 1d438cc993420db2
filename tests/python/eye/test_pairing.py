"""Pictures find their frames; times are made up, in milliseconds of one clock."""

from __future__ import annotations

import random

import pytest

from xplane_bridge.eye.pairing import Pairing
from xplane_bridge.eye.wire import BORDERLINE, DELAY_ASSUMED

MS = 1_000_000


def fly(pairing: Pairing, count: int, period_ms: float, delay_ms: float, jitter_ms: float = 0.0) -> list:
    """Frames and their pictures as they come; each picture is the number of its frame."""
    draw = random.Random(5)
    events = []
    for number in range(count):
        at = number * period_ms + draw.uniform(-jitter_ms, jitter_ms)
        events += [(at, number, False), (at + delay_ms, number, True)]
    decisions = []
    for at, number, is_picture in sorted(events):
        if is_picture:
            pairing.add_picture(round(at * MS), number)
        else:
            pairing.add_frame(round(at * MS), float(number))
        decisions += pairing.decided(round(at * MS))
    return decisions


@pytest.mark.parametrize("delay_ms", [0.0, 12.0, 50.0, 58.0, 199.0])
@pytest.mark.parametrize("jitter_ms", [0.0, 3.0])
def test_each_picture_has_its_own_frame_when_the_delay_is_known(delay_ms: float, jitter_ms: float):
    decisions = fly(Pairing(1e-3 * delay_ms), 100, 20.0, delay_ms, jitter_ms)
    assert len(decisions) >= 98  # the last wait for a frame after them
    assert [decision.picture for decision in decisions] == [int(decision.frame.key) for decision in decisions]
    assert not any(decision.flags for decision in decisions)


def test_a_delay_that_was_not_measured_is_wrong_by_whole_frames_and_said_so():
    """Perfectly regular frames and a delay of three periods: nothing in the times distinguishes it from none."""
    decisions = fly(Pairing(None), 100, 20.0, 60.0)
    assert {decision.picture - decision.frame.key for decision in decisions} == {-3.0}
    assert all(decision.flags == DELAY_ASSUMED for decision in decisions)


def frames(pairing: Pairing, *arrivals_ms: float) -> None:
    for at in arrivals_ms:
        pairing.add_frame(round(at * MS), at)


def decide(pairing: Pairing, *changes_ms: float) -> list:
    for at in changes_ms:
        pairing.add_picture(round(at * MS), at)
    return [(decision.frame.key, decision.flags) for decision in pairing.decided(round(max(changes_ms) * MS))]


@pytest.mark.parametrize("usual_ms", [0, 4, 15])
@pytest.mark.parametrize(
    ("seen_ms", "late_ms", "flags"),
    [
        (100, 0, 0),
        (100, 9, 0),
        (100, 11, BORDERLINE),
        (100, 60, BORDERLINE),
        (105, 14, 0),
        (105, 16, BORDERLINE),
        (96, 5, 0),
        (96, 7, BORDERLINE),
    ],
)
def test_a_picture_that_was_seen_so_late_that_it_may_be_the_frame_before_is_flagged(
    usual_ms: int, seen_ms: int, late_ms: int, flags: int
):
    """However long a look takes: what it usually takes is in the delay."""
    pairing = Pairing(0.0)
    frames(pairing, 0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 120.0)
    for at in (20, 40, 60, 80):
        pairing.add_picture(at * MS, "usual", usual_ms * MS)
    pairing.add_picture(seen_ms * MS, "seen now", (usual_ms + late_ms) * MS)
    decided = [(decision.frame.key, decision.flags) for decision in pairing.decided(120 * MS)]
    assert decided == [(20.0, 0), (40.0, 0), (60.0, 0), (80.0, 0), (100.0, flags)]


def test_a_picture_waits_for_the_frame_after_it():
    pairing = Pairing(0.0)
    frames(pairing, 0, 20)
    assert decide(pairing, 31) == []
    frames(pairing, 40)
    (decision,) = pairing.decided(41 * MS)
    assert decision.frame.key == 40.0
    assert decision.residual_s == pytest.approx(-9e-3)


def test_a_picture_is_decided_without_a_later_frame_when_none_comes():
    pairing = Pairing(0.0)
    frames(pairing, 0, 20, 40)
    pairing.add_picture(41 * MS, "last")
    assert pairing.decided(200 * MS) == []
    (decision,) = pairing.decided(300 * MS)
    assert decision.frame.key == 40.0


@pytest.mark.parametrize(
    ("change_ms", "flags"), [(26.0, 0), (26.9, 0), (27.1, BORDERLINE), (32.9, BORDERLINE), (33.1, 0)]
)
def test_what_lies_between_two_frames_is_flagged(change_ms: float, flags: int):
    pairing = Pairing(0.0)
    frames(pairing, 0, 20, 40, 60)  # 0.35 of 20 ms: 7 ms
    assert decide(pairing, change_ms) == [(20.0 if change_ms < 30 else 40.0, flags)]


def test_a_frame_is_shown_once():
    pairing = Pairing(0.0)
    frames(pairing, 0, 20, 40, 60)
    assert decide(pairing, 20, 29, 41, 59) == [(20.0, 0), (40.0, BORDERLINE), (60.0, 0)]
    assert pairing.dropped == 1  # 41 would be a second one of 40, and is too far from 60


def test_a_picture_of_no_frame_that_was_heard_is_dropped():
    pairing = Pairing(0.0)
    frames(pairing, 1000, 1020, 1040)
    assert decide(pairing, 900) == []
    assert pairing.dropped == 1


def test_a_stall_gives_no_picture_to_a_frame_far_away():
    pairing = Pairing(0.0)
    frames(pairing, 0, 20, 40, 60, 80, 300, 320)
    assert decide(pairing, 110, 270, 301) == [(300.0, 0)]  # a third of the stall is more than a frame
    assert pairing.dropped == 2


def test_a_late_frame_that_is_not_heard_yet_gives_its_picture_to_no_other():
    pairing = Pairing(0.0)
    frames(pairing, 0, 20, 40, 60, 200)
    pairing.add_picture(240 * MS, "of a frame that is not heard yet")
    assert pairing.decided(600 * MS) == []
    assert pairing.dropped == 1


def test_a_picture_of_before_the_first_frame_is_not_given_to_that():
    pairing = Pairing(0.060)
    frames(pairing, 100)
    assert decide(pairing, 110) == []
    frames(pairing, 120, 140)
    assert decide(pairing, 130, 161) == [(100.0, 0)]
    assert pairing.dropped == 2


def test_a_delay_that_was_measured_later_is_used_from_then_on():
    pairing = Pairing(None)
    frames(pairing, 0, 20, 40, 60, 80, 100)
    assert decide(pairing, 61) == [(60.0, DELAY_ASSUMED)]
    pairing.set_delay(0.020)
    assert decide(pairing, 101) == [(80.0, 0)]


def test_pictures_without_any_frame_are_given_up():
    pairing = Pairing(0.0)
    for number in range(40):
        pairing.add_picture(number * MS, number)
    assert pairing.dropped == 8  # 32 wait
    assert pairing.decided(1000 * MS) == []
    assert pairing.dropped == 40


def test_a_jump_of_the_phase_raises_the_flag():
    pairing = Pairing(0.030)
    decisions = fly(pairing, 200, 20.0, 39.0)  # 9 of 20 ms off
    assert not pairing.delay_is_sure
    assert decisions[-1].flags & DELAY_ASSUMED
    assert decisions[0].flags == BORDERLINE
    assert pairing.delay_s == pytest.approx(0.030, abs=1e-4)  # which way is not known: it is not followed


def test_slow_drift_is_followed_at_most_a_quarter_of_a_frame_an_hour():
    pairing = Pairing(0.030)
    fly(pairing, 50_000, 20.0, 34.0)  # 1000 s, 4 ms off: may follow by 5 ms * 1000 / 3600
    assert pairing.delay_s - 0.030 == pytest.approx(0.005 * 1000 / 3600, rel=0.02)
    assert pairing.delay_is_sure
