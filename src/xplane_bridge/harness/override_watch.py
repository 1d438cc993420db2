"""Looks at X-Plane's overrides on the wire: which are taken during a flight, and that none is left after it."""

from __future__ import annotations

import time
from typing import Dict, List, Set

from xplane_bridge.harness.flight_check import Verdict
from xplane_bridge.harness.processes import HarnessError, wait_until
from xplane_bridge.harness.xplane_client import XPlaneClient

_FOLDER = "sim/operation/override/"
#: What tx_node may take (docs/nodes/journal.md), without the folder.
OVERRIDES = (
    "override_joystick_roll",
    "override_joystick_pitch",
    "override_joystick_heading",
    "override_throttles",
    "override_toe_brakes",
    "override_control_surfaces",
)
_RATE_HZ = 10
_ASK_AGAIN_S = 1.0
_ANSWER_S = 5.0


class OverrideWatch:
    """A client that asks for nothing but the overrides.

    Args:
        port: X-Plane's, on this machine.
    """

    def __init__(self, port: int) -> None:
        self._client = XPlaneClient(port)
        self._values: Dict[int, float] = {}
        self._asked = 0.0
        #: Those that have been seen on.
        self.taken: Set[str] = set()

    def poll(self) -> Dict[str, float]:
        """Takes what has arrived; gives the newest value of each override that has answered."""
        if time.monotonic() > self._asked + _ASK_AGAIN_S:  # datagrams get lost
            self._asked = time.monotonic()
            self._client.subscribe([_FOLDER + name for name in OVERRIDES], rate_hz=_RATE_HZ)
        self._values.update(self._client.values())
        newest = {OVERRIDES[index]: value for index, value in self._values.items()}
        self.taken |= {name for name, value in newest.items() if value != 0.0}
        return newest

    def judge_end(self) -> Verdict:
        """Whether X-Plane, asked now, says that every override is off; to be called when the bridge has ended."""
        self._client.values()  # what was on its way before
        self._values.clear()
        try:
            wait_until(lambda: len(self.poll()) == len(OVERRIDES), _ANSWER_S, "answer of X-Plane")
        except HarnessError as error:
            return Verdict("released", False, f"{error}: whether overrides are left on is not known")
        left: List[str] = [name for name, value in self.poll().items() if value != 0.0]
        if left:
            return Verdict("released", False, f"X-Plane says that these are still on: {', '.join(left)}")
        if not self.taken:
            return Verdict("released", False, "no override was ever on: the bridge has not flown")
        taken = ", ".join(name for name in OVERRIDES if name in self.taken)
        return Verdict("released", True, f"X-Plane says that all overrides are off; on during the flight: {taken}")

    def close(self) -> None:
        """Ends it."""
        self._client.close()
