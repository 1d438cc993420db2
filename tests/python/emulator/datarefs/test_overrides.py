"""Which overrides act is what docs/experiments/emulator.md says; all others are kept and read back, and do nothing."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Callable, Set

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.tables.controls import OVERRIDES

PAGE = Path(__file__).resolve().parents[4] / "docs/experiments/emulator.md"
PREFIX = "sim/operation/override/override_"


def documented() -> Set[str]:
    """The overrides that act by the page: those before its list's colon."""
    (text,) = re.findall(r"^\* Overrides but ((?:.|\n  )*?):", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return set(re.findall(r"`override_(\w+)`", text))


def test_the_page_names_the_overrides_that_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    read: Set[str] = set()

    def noted(method: Callable[..., Any]) -> Callable[..., Any]:
        def call(store: DatarefStore, name: str, *more: int) -> Any:
            if name.startswith(PREFIX):
                read.add(name[len(PREFIX) :])
            return method(store, name, *more)

        return call

    for name in ("get", "dataref"):  # `gather`, `array` and `set` go by these
        monkeypatch.setattr(DatarefStore, name, noted(getattr(DatarefStore, name)))
    with EmulatorFixture(aircraft="fixed_wing", traffic=1) as emulator:
        emulator.client().send(protocol.CommandRequest("sim/autopilot/servos_on"))
        emulator.client().send(protocol.DrefWrite("sim/flightmodel/position/q[0]", 1.0))
        emulator.step(2)
    assert read == documented()
    assert read < set(OVERRIDES)
