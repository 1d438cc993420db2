"""A flight in process against the emulator's simulator, to which the same commands and failures go as datarefs."""

from __future__ import annotations

import dataclasses
import re
from typing import Any, Dict, Optional, Tuple

import pytest

from support.room_table import ROOT
from xplane_bridge import protocol
from xplane_bridge.emulator import command_channels
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.failure_effects import TRIM_FAILURES
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.in_process.aircraft import AUTO, MANUAL, Aircraft, Conditions, initial_state

DT = 1.0 / 60.0
OVERRIDE = "sim/operation/override/override_joystick_"
#: Channel to what tx_node writes of it.
WRITTEN = {
    "roll": "sim/joystick/yoke_roll_ratio",
    "pitch": "sim/joystick/yoke_pitch_ratio",
    "yaw": "sim/joystick/yoke_heading_ratio",
    "throttle": "sim/cockpit2/engine/actuators/throttle_ratio",
    "trim_pitch": "sim/cockpit2/controls/elevator_trim",
}
STICK = (WRITTEN["roll"], WRITTEN["pitch"], WRITTEN["yaw"])


class Flown:
    """The same flight twice, frame by frame."""

    def __init__(self, aircraft: str = "fixed_wing", **start: Any) -> None:
        conditions = Conditions(aircraft, start=start or {"altitude": 1000.0, "speed": 70.0}, mode=MANUAL)
        self.aircraft = Aircraft(conditions)
        self.sim = Simulator(create_model, aircraft, initial=initial_state(conditions.start))
        self._commanded: Dict[str, float] = {}
        self._changed: Dict[str, int] = {}

    def command(self, **values: float) -> None:
        """From now on; numbers that float32 has."""
        self._commanded.update(values)
        self._changed.update(dict.fromkeys(values, self.aircraft.frame))
        for name, axis in (("roll", "roll"), ("pitch", "pitch"), ("yaw", "heading")):
            if name in values:
                self._write(OVERRIDE + axis, 1.0)

    def fail(self, leaf: str, clear: bool = False) -> None:
        """It fails, or is repaired."""
        self.aircraft.failures.act({"name": leaf, "kind": "failed", "value": None, "clear": clear})
        self._write("sim/operation/failures/" + leaf, 0.0 if clear else 6.0)

    def fly(self, seconds: float) -> None:
        """On; each frame is the same."""
        for _ in range(round(seconds / DT)):
            self._step()

    @property
    def shown(self) -> Tuple[float, ...]:
        """Stick and lever in process."""
        view = self.aircraft.view()
        return view.control_roll, view.control_pitch, view.control_yaw, view.control_throttle

    def _step(self) -> None:
        if self._commanded:
            assert self.aircraft.command(MANUAL, self._commanded) is None
        for name, value in self._commanded.items():
            old = (self.aircraft.frame - self._changed[name]) * DT > 0.3 + 1e-6
            if not (name.startswith("trim") and old):
                for engine in range(2 if name == "throttle" else 1):
                    self._write(f"{WRITTEN[name]}[{engine}]" if name == "throttle" else WRITTEN[name], value)
        self.aircraft.step()
        self.sim.step(DT)
        assert dataclasses.asdict(self.aircraft.state) == dataclasses.asdict(self.sim.model.state)
        shown = (*map(self.sim.store.get, STICK), self.sim.store.get(WRITTEN["throttle"]))
        assert self.shown == pytest.approx(shown, rel=1e-7, abs=1e-9)

    def _write(self, path: str, value: float) -> None:
        assert self.sim.on_dref(protocol.DrefWrite(path, value)) is None


CENTRED = {"roll": 0.0, "pitch": 0.0, "yaw": 0.0}


@pytest.mark.parametrize("leaf", ["throt_lo", "throt_hi", "fc_thr", "fc_ail_R", "conlock", "engfai1"])
@pytest.mark.parametrize("throttle", [None, 0.5])
def test_what_failed_and_is_repaired_is_where_its_command_is(leaf: str, throttle: Optional[float]) -> None:
    flown = Flown()
    flown.command(**CENTRED, **({} if throttle is None else {"throttle": throttle}))
    flown.fly(0.5)
    lever = flown.shown[3]
    flown.fail("rel_" + leaf)
    flown.fly(0.25)
    flown.command(roll=0.25)
    flown.fly(0.25)
    assert flown.shown == pytest.approx((0.25, 0.0, 0.0, lever))
    flown.fail("rel_" + leaf, clear=True)
    flown.fly(0.5)
    assert flown.aircraft.controls.throttle[:2] == pytest.approx([lever, lever])


@pytest.mark.parametrize("commanded", [None, 0.0, 0.25])
@pytest.mark.parametrize("leaf", sorted(TRIM_FAILURES))
def test_a_trim_that_ran_away_stays_there_until_its_command_changes(leaf: str, commanded: Optional[float]) -> None:
    flown = Flown()
    flown.command(**CENTRED, **({} if commanded is None else {"trim_pitch": commanded}))
    flown.fly(0.5)
    before = flown.aircraft.controls.trim_pitch
    flown.fail(leaf)
    flown.fly(1.0)
    flown.fail(leaf, clear=True)
    flown.fly(0.5)
    moved = 0.05 if leaf == "rel_elv_trim_run" else 0.0
    assert flown.aircraft.controls.trim_pitch == pytest.approx(before + moved)
    flown.command(trim_pitch=0.125)
    flown.fly(0.1)
    assert flown.aircraft.controls.trim_pitch == 0.125


def test_a_trim_is_sent_for_a_while_after_its_change() -> None:
    flown = Flown()
    flown.command(**CENTRED, trim_pitch=0.0)
    flown.fly(0.5)
    flown.fail("rel_elv_trim_run")
    flown.fly(0.5)
    flown.command(trim_pitch=0.25)
    flown.fly(0.2)
    flown.fail("rel_elv_trim_run", clear=True)
    flown.fly(0.2)
    assert flown.aircraft.controls.trim_pitch == 0.25


def test_a_trim_that_is_commanded_anew_is_sent_though_it_is_the_same() -> None:
    """As in tests/cpp/actuation/control_path/handles.cpp; a change of the mode alone begins no command."""
    trims = command_channels.TrimsOnChange()

    def is_sent(now: float, commanded: bool, mode: int = MANUAL) -> bool:
        sent = {"trim_pitch": 0.25}
        trims.leave_out(sent, mode, lambda _: commanded, now)
        return bool(sent)

    assert is_sent(0.0, True)
    assert not is_sent(1.0, True)
    assert not is_sent(2.0, False)
    assert is_sent(3.0, True)
    assert not is_sent(4.0, False, AUTO)
    assert not is_sent(5.0, True)


def test_trims_are_sent_as_long_as_by_tx_node() -> None:
    text = (ROOT / "lib/actuation/control_path_sending.cpp").read_text(encoding="utf-8")
    match = re.search(r"kHandleRepeat = ([\d.]+);", text)
    assert match is not None
    assert float(match.group(1)) == command_channels.TRIM_REPEAT_S


def test_a_stick_that_nothing_commands_is_centred() -> None:
    flown = Flown("multirotor", altitude=100.0, speed=10.0)
    assert flown.aircraft.model.trim_controls.pitch != 0.0
    assert flown.shown[:3] == (0.0, 0.0, 0.0)
    flown.command(yaw=0.0)
    flown.fly(1.0)
    assert flown.aircraft.view().pitch_deg == pytest.approx(0.0, abs=0.5)
