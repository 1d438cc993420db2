"""What each channel of tx_node's arbiter moves in the emulator, without datarefs in between."""

from __future__ import annotations

from typing import Mapping

from xplane_bridge.emulator.flight.flight_model import Controls, FlightModel

#: Channels of one number, and what of `Controls` they are.
ATTRIBUTES = {
    "roll": "roll", "pitch": "pitch", "yaw": "yaw", "trim_roll": "trim_roll", "trim_pitch": "trim_pitch",
    "trim_yaw": "trim_yaw", "flaps": "flap_request", "speedbrake": "speedbrake", "parking_brake": "parking_brake",
    "left_brake": "brake_left", "right_brake": "brake_right", "thrust_vector": "thrust_vector",
}  # fmt: skip


def apply_channels(sent: Mapping[str, float], controls: Controls, model: FlightModel) -> None:
    """What the arbiter sends, as the emulator takes it from its datarefs."""
    info = model.info
    for name, value in sent.items():
        attribute = ATTRIBUTES.get(name)
        if attribute is not None:
            setattr(controls, attribute, value)
        elif name == "gear":
            controls.gear_down = value != 0.0
        else:
            kind, engine = name[:-1].split("[")
            if kind == "motors":
                controls.override_throttles = True
                controls.throttle_use[int(engine)] = value
            else:
                controls.throttle[int(engine)] = min(max(value, info.min_throttle), info.max_throttle)
