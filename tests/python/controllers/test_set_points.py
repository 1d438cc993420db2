"""Set-points one after the other: where the nose points is the doing of the newest."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Callable, Optional

import pytest

from xplane_bridge.controllers.set_points import HOLDS_S, SetPoints

STEP_S = 0.02


class Craft:
    """Stands at its place, and turns as its yaw command says."""

    def __init__(self) -> None:
        self.time = self.heading_deg = 0.0
        self.set_points = SetPoints()

    def state(self) -> Any:
        still = SimpleNamespace(x=0.0, y=0.0, z=0.0)
        return SimpleNamespace(
            sim_time_unwrapped=self.time, latitude=37.0, longitude=127.0, altitude_msl=110.0, on_ground=False,
            roll_deg=0.0, pitch_deg=0.0, heading_true_deg=self.heading_deg % 360.0, velocity_ned=still,
            vertical_speed=0.0, position_north=0.0, position_east=0.0, position_down=-10.0,
        )  # fmt: skip

    def fly(self, seconds: float, send: Optional[Callable[[], None]] = None) -> None:
        """Flies; `send` repeats a set-point."""
        for _ in range(round(seconds / STEP_S)):
            if send is not None:
                send()
            command = self.set_points.fly(self.state())
            self.heading_deg += 100.0 * command.get("yaw", 0.0) * STEP_S
            self.time += STEP_S

    def forward(self, turn_deg_s: float = 0.0) -> Callable[[], None]:
        return lambda: self.set_points.velocity(0.0, 1.0, 0.0, turn_deg_s)


def test_a_velocity_after_a_place_keeps_the_heading_that_the_place_gave() -> None:
    craft = Craft()
    craft.fly(2.0, craft.forward())
    craft.fly(6.0, lambda: craft.set_points.position(0.0, 0.0, 10.0, 90.0))
    craft.fly(6.0, craft.forward())
    assert craft.heading_deg == pytest.approx(90.0, abs=1.0)


def test_a_velocity_after_silence_keeps_the_heading_that_the_failsafe_left() -> None:
    craft = Craft()
    craft.fly(2.0, craft.forward())
    craft.fly(HOLDS_S + 0.1)
    craft.heading_deg = 180.0
    craft.fly(6.0, craft.forward())
    assert craft.heading_deg == pytest.approx(180.0, abs=1.0)


def test_velocities_that_follow_each_other_turn_on_from_where_they_are_to_be() -> None:
    craft = Craft()
    craft.fly(4.0, craft.forward(30.0))
    craft.fly(HOLDS_S - 0.1)  # no pause: the last one still counts
    craft.fly(4.0, craft.forward())
    assert craft.heading_deg == pytest.approx((4.0 + HOLDS_S - 0.1) * 30.0, abs=1.0)
