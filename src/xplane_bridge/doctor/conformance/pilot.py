"""Keeps the aircraft level and near its speed while questions are asked, and watches its height."""

from __future__ import annotations

import threading
import time
from typing import Optional, Tuple

from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.link import FAST_HZ, Sample, XPlane

#: Stick for each degree and each degree a second off.
_PER_DEG, _PER_DEG_S = 0.03, 0.015
#: Nose up for each m/s too fast [deg], and its limits.
_PER_MPS, _PITCH_DEG = 0.4, (-5.0, 7.0)
_RENEW_S = 2.0
_INPUTS = (names.TRUE_ROLL, names.TRUE_PITCH, *names.RATES_DEG_S, names.TRUE_AIRSPEED, names.HEIGHT)


class Pilot:
    """A thread that holds the stick.

    Args:
        xplane: The simulator.
        speed_mps: True airspeed to keep [m/s].
        lowest_m: Height above ground below which `too_low` is set [m].

    Attributes:
        roll_deg: Bank that is held, right wing down + [deg].
        pitch_deg: Pitch that is held [deg]; None: by speed.
        rudder: Pedals, right +, -1..1.
        hands_off: No commands at all.
        too_low: Set when the aircraft is too low.
    """

    def __init__(self, xplane: XPlane, speed_mps: float, lowest_m: float) -> None:
        self.roll_deg, self.rudder = 0.0, 0.0
        self.pitch_deg: Optional[float] = None
        self.stick: Optional[Tuple[float, float]] = None  #: roll and pitch of the stick instead of attitudes
        self.hands_off = False
        self.too_low = threading.Event()
        self._xplane, self._speed_mps, self._lowest_m = xplane, speed_mps, lowest_m
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Lets the stick go; the overrides are the flight's."""
        self._stop.set()
        self._thread.join()

    def level(self) -> None:
        """Wings level, speed kept, pedals centred."""
        self.roll_deg, self.pitch_deg, self.rudder, self.stick, self.hands_off = 0.0, None, 0.0, None, False

    def _run(self) -> None:
        with self._xplane.receiver() as receiver:
            while not self._stop.is_set():
                receiver.subscribe(_INPUTS, FAST_HZ)
                renew = time.monotonic() + _RENEW_S
                for sample in receiver.samples(renew):
                    self._fly(sample)
                    if self._stop.is_set() or time.monotonic() > renew:
                        break

    def _fly(self, now: Sample) -> None:
        if now[names.HEIGHT] < self._lowest_m:
            self.too_low.set()
        if self.hands_off:
            return
        if self.stick is not None:
            roll, pitch = self.stick
        else:
            low, high = _PITCH_DEG
            by_speed = min(max(_PER_MPS * (now[names.TRUE_AIRSPEED] - self._speed_mps), low), high)
            wanted = by_speed if self.pitch_deg is None else self.pitch_deg
            p, q, _ = (now[path] for path in names.RATES_DEG_S)
            roll = _PER_DEG * (self.roll_deg - now[names.TRUE_ROLL]) - _PER_DEG_S * p
            pitch = _PER_DEG * (wanted - now[names.TRUE_PITCH]) - _PER_DEG_S * q
        for path, value in zip(names.YOKE, (roll, pitch, self.rudder)):
            self._xplane.write(path, min(max(value, -1.0), 1.0))
