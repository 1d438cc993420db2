"""Surfaces that clients move, lock and read by X-Plane's names."""

from __future__ import annotations

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import compiled, protocol

WING = "sim/flightmodel2/wing/"
CONTROLS = "sim/flightmodel/controls/"
ELEVATOR = CONTROLS + "hstab1_elv1def"
LOCK = "sim/operation/failures/rel_fcon_elev_1_lft_lock"


@pytest.mark.parametrize("in_cpp", [True, False])
@pytest.mark.parametrize("aircraft", ["kinematic", "fixed_wing"])
def test_each_lock_keeps_an_overridden_surface_where_it_is_then(
    monkeypatch: pytest.MonkeyPatch, aircraft: str, in_cpp: bool
) -> None:
    if not in_cpp:
        monkeypatch.setattr(compiled, "core", None)
    with EmulatorFixture(aircraft=aircraft, version="12.10") as emulator:
        emulator.write({"sim/operation/override/override_control_surfaces": 1.0})
        for angle in (-5.0, 8.0):
            emulator.write({LOCK: 0.0, ELEVATOR: angle})
            emulator.step(2)
            emulator.write({LOCK: 6.0, ELEVATOR: 0.0})
            emulator.step(30)
            assert emulator.read(ELEVATOR) == [angle]


def test_an_element_without_a_surface_is_of_its_array_alone() -> None:
    elements = ["elevator1_deg[3]", "rudder1_deg[0]", "aileron1_deg[30]", "flap1_deg[20]", "elevator1_deg[2]"]
    with EmulatorFixture(aircraft="fixed_wing") as emulator:
        emulator.write({WING + elements[0]: 7.0})
        assert emulator.read(*(WING + element for element in elements)) == [7.0, 0.0, 0.0, 0.0, 0.0]
        assert emulator.read(CONTROLS + "elv1_def[0]", CONTROLS + "rudd_def[0]") == [0.0, 0.0]


def test_speed_brakes_go_down_to_extend() -> None:
    with EmulatorFixture(aircraft="fixed_wing") as emulator:
        client = emulator.client()
        for direction, handle in (("down", 1.0), ("up", 0.0)):
            client.send(protocol.CommandRequest(f"sim/flight_controls/speed_brakes_{direction}_all"))
            assert emulator.read("sim/cockpit2/controls/speedbrake_ratio") == [handle]
