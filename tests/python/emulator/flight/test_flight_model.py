"""What flight models and their callers hand each other."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import pytest

from xplane_bridge.emulator.flight.flight_model import Controls, EngineState, GearState, ModelState

KINDS = (Controls, EngineState, GearState, ModelState)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_field_that_there_is_not_cannot_be_set(kind):
    made = kind()
    with pytest.raises(AttributeError, match="wrong_name"):
        made.wrong_name = 1.0
    assert not hasattr(made, "__dict__"), "reading and writing takes longer again"


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("again", [copy.deepcopy, copy.copy, lambda made: pickle.loads(pickle.dumps(made))])
def test_a_copy_has_all_fields(kind, again):
    made = kind()
    for number, field in enumerate(dataclasses.fields(kind)):
        setattr(made, field.name, [float(number)])
    copied = again(made)
    assert type(copied) is kind
    assert copied == made
    assert [getattr(copied, f.name) for f in dataclasses.fields(kind)] == [
        [float(i)] for i in range(len(kind.__slots__))
    ]


def test_defaults_are_each_object_s_own():
    first, second = Controls(roll=0.5), Controls()
    first.throttle[0] = 1.0
    first.surface_deg["vstab1_rud1"] = 3.0
    assert (second.roll, second.throttle[0], second.surface_deg, second.gear_down) == (0.0, 0.0, {}, True)
    independent = first.copy()
    independent.throttle[0] = 0.25
    assert first.throttle[0] == 1.0
