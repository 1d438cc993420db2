"""What each channel of tx_node's arbiter moves in the emulator, without datarefs in between."""

from __future__ import annotations

from functools import lru_cache
from typing import Callable, Dict, Mapping, Tuple

from xplane_bridge.emulator.flight.flight_model import Controls, FlightModel, ModelInfo

#: Channels of one number, and what of `Controls` they are.
ATTRIBUTES = {
    "roll": "roll", "pitch": "pitch", "yaw": "yaw", "trim_roll": "trim_roll", "trim_pitch": "trim_pitch",
    "trim_yaw": "trim_yaw", "flaps": "flap_request", "speedbrake": "speedbrake", "parking_brake": "parking_brake",
    "left_brake": "brake_left", "right_brake": "brake_right", "thrust_vector": "thrust_vector",
}  # fmt: skip
#: Trims, both as channels and in `Controls`.
TRIMS = ("trim_roll", "trim_pitch", "trim_yaw")
#: How long tx_node sends a trim after a change [s]: kHandleRepeat of lib/actuation/control_path_sending.cpp.
TRIM_REPEAT_S = 0.3


class TrimsOnChange:
    """Trims as tx_node sends them: for a while after a change, so that one that a failure has moved stays there."""

    def __init__(self) -> None:
        self._changed: Dict[str, Tuple[float, float]] = {}  # by channel: its value, and since when it is that [s]
        self._commanded: Dict[Tuple[int, str], bool] = {}  # by mode and channel, when last sent in it

    def leave_out(self, sent: Dict[str, float], mode: int, commands: Callable[[str], bool], now: float) -> None:
        """Takes out of what the arbiter sends the trims that tx_node no longer sends.

        Args:
            sent: By channel.
            mode: Of the arbiter.
            commands: Whether what flies commands a channel.
            now: [s]
        """
        for name in TRIMS:
            commanded = commands(name)
            anew = commanded and not self._commanded.get((mode, name), False)
            self._commanded[mode, name] = commanded
            if name not in sent:
                continue
            value, since = self._changed.get(name, (None, now))
            if anew or sent[name] != value:
                self._changed[name] = sent[name], now
            elif now - since > TRIM_REPEAT_S:
                del sent[name]


def apply_channels(sent: Mapping[str, float], controls: Controls, model: FlightModel) -> None:
    """What the arbiter sends, as the emulator takes it from its datarefs."""
    info = model.info
    low, high = info.min_throttle, info.max_throttle
    if controls.override_throttles and not any(name.startswith("motors") for name in sent):
        _give_motors_back(controls, info)
    for name, value in sent.items():
        attribute = ATTRIBUTES.get(name)
        if attribute is not None:
            setattr(controls, attribute, value)
        elif name == "gear":
            controls.gear_down = value != 0.0
        else:
            kind, engine = _of_engine(name)
            if kind == "motors":
                controls.override_throttles = True
                controls.throttle_use[engine] = value
            else:
                # Not by min(max()), which takes longer: this is done in each frame of a campaign.
                controls.throttle[engine] = low if value < low else high if value > high else value


def _give_motors_back(controls: Controls, info: ModelInfo) -> None:
    """Levers fly again, from where the motors were, as tx_node leaves them."""
    controls.override_throttles = False
    controls.throttle[:] = [min(max(value, info.min_throttle), info.max_throttle) for value in controls.throttle_use]


@lru_cache(maxsize=None)
def _of_engine(channel: str) -> Tuple[str, int]:
    """What an engine's channel moves, and the engine's number."""
    kind, engine = channel[:-1].split("[")
    return kind, int(engine)
