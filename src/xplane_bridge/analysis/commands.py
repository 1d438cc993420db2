"""What was commanded, of recorded AppliedCommands."""

from __future__ import annotations

from typing import Mapping

import numpy as np

from xplane_bridge.constants import CommandSource, ControlField

#: ControlCommand's bits, as in AppliedCommand.fields; THROTTLE, ENGINE_THROTTLES and MOTORS all fill `throttles`.
_BITS = {
    "roll": ControlField.ROLL,
    "pitch": ControlField.PITCH,
    "yaw": ControlField.YAW,
    "throttles": ControlField.THROTTLE | ControlField.ENGINE_THROTTLES | ControlField.MOTORS,
}


def of_controls(applied: Mapping[str, np.ndarray]) -> np.ndarray:
    """Which AppliedCommands are of ControlCommands or the failsafe [bool]; the others are of single surfaces alone."""
    own: np.ndarray = (applied["source"] != CommandSource.NONE) | (applied["fields"] != 0)
    return own


def commanded(applied: Mapping[str, np.ndarray], column: str) -> np.ndarray:
    """Which AppliedCommands command roll, pitch, yaw or throttles [bool]; in the others the column is no command."""
    sent: np.ndarray = (applied["fields"].astype(np.int64) & _BITS[column].value) != 0
    return sent
