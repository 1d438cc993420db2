"""What X-Plane does while it is paused."""

from __future__ import annotations

import math
import time

from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.vectors import length
from xplane_bridge.doctor.conformance.verdict import Answer, judged

_BANK_DEG = 15.0
_FASTER = 1.1


def _paused_output(flight: Flight) -> Answer:
    with flight.paused(), flight.xplane.receiver() as receiver:
        time.sleep(0.3)
        receiver.subscribe([names.RUNNING_TIME], 50)
        count = sum(1 for _ in receiver.datagrams(time.monotonic() + 1.0))
    return judged(count > 5, f"{count} values of 50 a second come in one second of pause", values=count)


def _paused_motion(flight: Flight) -> Answer:
    """A bank and a higher speed written during a pause: shown during it, and flown after it."""
    flight.pilot.hands_off = True
    with flight.paused() as shown:
        bank = flight.xplane.read(names.TRUE_ROLL)[names.TRUE_ROLL] + _BANK_DEG
        before = flight.xplane.read(*names.QUATERNION, *names.LOCAL_VELOCITY)
        half = math.radians(_BANK_DEG) / 2.0
        c, s = math.cos(half), math.sin(half)
        w, x, y, z = (before[path] for path in names.QUATERNION)
        banked = (w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s)
        faster = [_FASTER * before[path] for path in names.LOCAL_VELOCITY]
        for path, value in zip((*names.QUATERNION, *names.LOCAL_VELOCITY), (*banked, *faster)):
            flight.xplane.write(path, value)
        time.sleep(0.3)
        held = flight.xplane.read(*names.QUATERNION, *names.LOCAL_VELOCITY)
    after = flight.fly((names.TRUE_ROLL, *names.LOCAL_VELOCITY), 0.3)[0]
    off = max(abs(held[path] - value) for path, value in zip(names.QUATERNION, banked))
    speeds = [length([each[path] for path in names.LOCAL_VELOCITY]) for each in (before, held, after.values)]
    roll = after[names.TRUE_ROLL]
    text = (
        f"q is {off:.3f} off what was written during the pause; bank {roll:.1f} deg when it flies on, {bank:.1f} "
        f"written; speed {speeds[0]:.1f} m/s, {speeds[1]:.1f} when {_FASTER * speeds[0]:.1f} was written, "
        f"{speeds[2]:.1f} when it flies on" + ("" if shown else " (the pause itself was not shown)")
    )
    good = off < 0.02 and abs(roll - bank) < 5.0 and abs(speeds[2] - _FASTER * speeds[0]) < 0.05 * speeds[0]
    return judged(good, text, quaternion_off=off, bank_deg=roll, speeds_mps=speeds)


QUESTIONS = (
    Question("paused-output", "values come while X-Plane is paused", _paused_output, flies=False),
    Question("paused-motion", "q and velocity written during a pause are flown after it", _paused_motion),
)
