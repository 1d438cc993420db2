"""Fields of ControlCommand by name, as controllers, environments and the player give them, into the message."""

from __future__ import annotations

from typing import Any, Mapping

from xplane_bridge.constants import COMMAND_FIELDS, ControlField

#: Fields with a number for each engine.
_ENGINE_FIELDS = {"engine_throttles": ControlField.ENGINE_THROTTLES, "motors": ControlField.MOTORS}


def fill_fields(message: Any, values: Mapping[str, Any]) -> None:
    """Puts values into a ControlCommand, which then commands these fields and no others.

    Args:
        message: The ControlCommand.
        values: A number for each name; of `engine_throttles` and `motors` a list, one number for each engine.

    Raises:
        ValueError: There is no such field, or there are too many engines.
        TypeError: A value is not what the field takes.
    """
    message.fields = 0
    for name, value in values.items():
        if name in _ENGINE_FIELDS:
            message.fields |= _ENGINE_FIELDS[name].value
            # As numbers: what is none is to be found here, not where the message is sent.
            numbers, most = [float(number) for number in value], len(getattr(message, name))
            if len(numbers) > most:
                raise ValueError(f"{name} has {len(numbers)} numbers; expected one for each engine, {most} at most")
            message.engine_count = len(numbers)
            setattr(message, name, numbers + [0.0] * (most - len(numbers)))
        elif name in COMMAND_FIELDS:
            message.fields |= COMMAND_FIELDS[name].bit.value
            setattr(message, name, float(value))
        else:
            known = ", ".join((*COMMAND_FIELDS, *_ENGINE_FIELDS))
            raise ValueError(f"{name!r} is no field of ControlCommand; expected some of {known}")
