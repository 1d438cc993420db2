"""What tests do again on a busy machine, and only there."""

from __future__ import annotations

import subprocess
import warnings

import pytest

from support.again import again_until
from support.flights.disturbed import ATTEMPTS, Flown, is_disturbed, until_undisturbed
from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.constants import FlightMode, LinkState


def record(file, mode=FlightMode.AUTO, failsafe=False, state=LinkState.CONNECTED, late_s=0.0):
    """Two seconds, in which one command and one state come later than the others."""
    with FlightBag(file) as bag:
        for k in range(40):
            time_ns = stamp_ns(0.05 * k + (late_s if k >= 20 else 0.0))
            values = {
                "control/mode": ("ControlMode", {"mode": mode, "failsafe": failsafe and k == 9}),
                "link_state": ("LinkState", {"state": state if k == 9 else LinkState.CONNECTED}),
                "flight_state": ("FlightState", {"header": bag.header(time_ns, "", k)}),
                "control/auto": ("ControlCommand", {}),
            }
            for topic, (kind, fields) in values.items():
                bag.add(f"/xplane/{topic}", f"xplane_bridge/{kind}", time_ns, fields)
    return file


@pytest.mark.parametrize(
    ("how", "disturbed"),
    [
        ({}, False),
        ({"failsafe": True}, True),
        ({"failsafe": True, "mode": FlightMode.MANUAL}, False),
        ({"state": LinkState.STALE}, True),
        ({"late_s": 0.1}, False),
        ({"late_s": 0.3}, True),
    ],
)
def test_a_disturbed_flight_is_recognised_by_its_recording(tmp_path, how, disturbed):
    assert is_disturbed(record(tmp_path / "flight.bag", **how)) == disturbed


def test_without_a_recording_no_flight_is_disturbed(tmp_path):
    assert not is_disturbed(tmp_path / "none.bag")
    with FlightBag(tmp_path / "early.bag") as bag:
        bag.add("/xplane/control/auto", "xplane_bridge/ControlCommand", stamp_ns(0.0), {})
    assert not is_disturbed(tmp_path / "early.bag")


@pytest.mark.parametrize(
    ("codes", "late_s", "flights", "well"),
    [
        ([0], 1.0, 1, True),
        ([1, 0], 1.0, 2, True),
        ([1] * ATTEMPTS, 1.0, ATTEMPTS, False),
        ([1, 0], 0.0, 1, False),  # a defect, not the machine
    ],
)
def test_only_what_was_disturbed_and_missed_its_criteria_is_flown_again(tmp_path, codes, late_s, flights, well):
    flown = []

    def fly(number):
        out = tmp_path / str(number)
        out.mkdir()
        record(out / "flight.bag", late_s=late_s)
        flown.append(out)
        return Flown.into(out, subprocess.CompletedProcess([], codes[number], "a criterion", ""))

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        if well:
            assert until_undisturbed(fly).folder == flown[-1]
        else:
            with pytest.raises(AssertionError, match="a criterion"):
                until_undisturbed(fly)
    assert len(flown) == flights
    assert sum("is flown again" in str(warning.message) for warning in said) == flights - 1


def test_what_does_not_fit_is_done_again_a_few_times():
    done = iter(range(10))
    assert again_until(lambda number: number == 2, lambda: next(done)) == 2
    assert again_until(lambda number: number == 2, lambda: next(done), attempts=3) == 5
