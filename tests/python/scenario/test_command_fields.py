"""Values by name in a ControlCommand: what gym's axes and a campaign's controllers give."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from xplane_bridge.constants import COMMAND_FIELDS, ControlField
from xplane_bridge.scenario.command_fields import fill_fields


def filled(values: dict) -> SimpleNamespace:
    message = SimpleNamespace(fields=0, engine_count=0, engine_throttles=[0.0] * 8, motors=[0.0] * 8)
    fill_fields(message, values)
    return message


def test_each_number_has_its_field() -> None:
    for name, field in COMMAND_FIELDS.items():
        message = filled({name: 1})
        assert (getattr(message, name), message.fields) == (1.0, field.bit)


@pytest.mark.parametrize("name", ["engine_throttles", "motors"])
def test_engines_have_a_number_each(name: str) -> None:
    message = filled({"roll": 0.25, name: (0.5, 0.75)})
    assert message.fields == ControlField.ROLL | ControlField[name.upper()]
    assert (message.roll, message.engine_count) == (0.25, 2)
    assert getattr(message, name) == [0.5, 0.75, *[0.0] * 6]


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ({"aileron": 0.1}, ValueError, "'aileron' is no field of ControlCommand; expected some of roll, .*, motors"),
        ({"motors": [0.5] * 9}, ValueError, "motors has 9 numbers; expected one for each engine, 8 at most"),
        ({"motors": 0.5}, TypeError, "not iterable"),
        ({"motors": [None]}, TypeError, "float"),
        ({"roll": None}, TypeError, "float"),
    ],
)
def test_what_is_no_command_is_said(values: dict, error: type, text: str) -> None:
    with pytest.raises(error, match=text):
        filled(values)
