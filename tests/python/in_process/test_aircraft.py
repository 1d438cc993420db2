from __future__ import annotations

import copy
import re
import struct
from typing import Iterator, List

import pytest

from support.room_table import ROOT
from xplane_bridge import compiled
from xplane_bridge.compiled import core
from xplane_bridge.constants import FAILURE_KINDS, SURFACE_FAILURE_KINDS, FlightMode
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.datarefs.aircraft_systems import Weather
from xplane_bridge.emulator.flight.earth import LocalFrame
from xplane_bridge.emulator.flight.failure_effects import FailureEffects
from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    InitialState,
    ModelState,
    SurfaceFault,
    SurfaceFaultKind,
)
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.in_process.aircraft import AUTO, MANUAL, Aircraft, Conditions, arbiter_options
from xplane_bridge.in_process.failures import Failures, NotFlownError
from xplane_bridge.in_process.view import FlightView
from xplane_bridge.surfaces import SURFACES
from xplane_bridge.xplane_names import datarefs


def test_a_surface_fails_in_the_model_and_an_engine_by_its_dataref() -> None:
    model = create_model("fixed_wing")
    failures, controls = Failures(model), Controls()
    failures.act({"name": "aileron1_wing2_left", "kind": "stuck", "value": 5.0, "clear": False})
    failures.act({"name": "engine_2", "kind": "failed", "value": None, "clear": False})
    flown = failures.apply(controls, 1 / 60)
    assert flown.surface_faults == {"wing2l_ail1": SurfaceFault(SurfaceFaultKind.STUCK, 5.0)}
    assert [fault.value for fault in flown.engine_faults[:2]] == ["none", "stopped"]
    failures.act({"name": "aileron1_wing2_left", "kind": "failed", "value": None, "clear": True})
    flown = failures.apply(controls, 1 / 60)
    assert flown.surface_faults == {}
    assert flown.engine_faults[1].value == "stopped"
    failures.clear()
    assert failures.apply(controls, 1 / 60).engine_faults[1].value == "none"
    assert failures.apply(controls, 1 / 60) is controls
    assert controls == Controls()
    with pytest.raises(NotFlownError, match="it takes the bridge"):
        failures.act({"name": "pitot_1", "kind": "failed", "value": None, "clear": False})


@pytest.mark.parametrize("name", ["aileron2_wing1_left", "speedbrake1_wing1_left", "elevator1_wing1_left"])
def test_a_surface_that_the_aircraft_has_not_is_refused_with_those_it_has(name: str) -> None:
    with pytest.raises(NotFlownError, match=f"{name}': expected a surface that fixed_wing has .aileron1_wing2_left,"):
        Failures(create_model("fixed_wing")).act({"name": name, "kind": "stuck", "value": None, "clear": False})


def act(failures: Failures, name: str, clear: bool = False) -> None:
    failures.act({"name": name, "kind": "failed", "value": None, "clear": clear})


def test_a_system_is_broken_and_repaired_by_one_of_its_names() -> None:
    """As by tx_node: no other name acts on it, and what is not broken stays as it is."""
    failures, controls = Failures(create_model("fixed_wing")), Controls()
    act(failures, "engine_2", clear=True)
    act(failures, "engine_1")
    act(failures, "engine_1")
    act(failures, "rel_engfai0", clear=True)
    with pytest.raises(NotFlownError, match="rel_engfai0': broken already as engine_1; expected it to be cleared"):
        act(failures, "rel_engfai0")
    assert failures.apply(controls, 1 / 60).engine_faults[0].value == "stopped"
    act(failures, "engine_1", clear=True)
    act(failures, "rel_engfai0")
    failures.clear()
    act(failures, "engine_1")


@pytest.mark.parametrize(
    "name",
    [
        "engine_3",
        "rel_engfai2",
        "rel_engfail0",
        "rel_nonsense",
        "rel_fcon_ail_9_lft_lock",
        "rel_fcon_x",
        "rel_adc_comp",
    ],
)
def test_what_would_break_nothing_is_refused(name: str) -> None:
    failures = Failures(create_model("fixed_wing"))
    for clear in (False, True):
        with pytest.raises(
            NotFlownError, match=r"none of that name that acts in process; .* engine_1\.\.2, or a rel_\*"
        ):
            failures.act({"name": name, "kind": "failed", "value": None, "clear": clear})


@pytest.mark.parametrize(("kind", "value"), [("reduced", 0.5), ("stuck", None), ("failed", 0.3)])
def test_a_system_works_or_does_not(kind: str, value: object) -> None:
    failures = Failures(create_model("fixed_wing"))
    with pytest.raises(NotFlownError, match="expected kind failed, and no value"):
        failures.act({"name": "engine_1", "kind": kind, "value": value, "clear": False})


@pytest.mark.parametrize(
    "leaf",
    ["stbaug", "conlock", "ail_L_jam", "elv_R_jam", "rud_trim_run", "trim_elv", "flap_act", "gear_act", "lbrakes",
     "rbrakes", "throt_lo", "throt_hi", "fc_thr", "fc_ail_L", "ail_R2", "fc_elv_U1", "elv_D", "rud_L", "fc_rud_R",
     "fc_L_flp", "R_flp_off", "fcon_ailn_1_lft_lock", "seize_0", "engfla1", "engsep0", "fuelfl1"],
)  # fmt: skip
def test_what_is_said_to_act_does(leaf: str) -> None:
    model = create_model("fixed_wing")
    assert FailureEffects.acts(f"rel_{leaf}", model)
    differs = False
    for sign in (1.0, -1.0):
        effects, seen = FailureEffects(), []
        for failed in (set(), {f"rel_{leaf}"}):
            controls = Controls()
            for frame in range(2):  # what freezes keeps what the first had
                for name in ("roll", "pitch", "yaw", "trim_roll", "trim_pitch", "trim_yaw"):
                    setattr(controls, name, sign * 0.2 * (frame + 1))
                controls.flap_request, controls.gear_down = 0.3 * (frame + 1), bool(frame)
                controls.brake_left = controls.brake_right = 0.5
                controls.throttle[:2] = [0.3 * (frame + 1)] * 2
                effects.apply(controls, failed, model, 1 / 60)
            seen.append(copy.deepcopy(controls))
        differs |= seen[0] != seen[1]
    assert differs


class InOrder(set):
    """A set that is gone through in an order of the test's."""

    def __init__(self, items: List[str]) -> None:
        super().__init__(items)
        self._items = items

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)


def test_of_two_failures_of_a_surface_always_the_same_acts() -> None:
    leaves = ["rel_fcon_ailn_1_lft_mxdn", "rel_fcon_ailn_1_lft_mxup"]
    model, seen = create_model("fixed_wing"), []
    for order in (leaves, leaves[::-1]):
        controls = Controls()
        FailureEffects().apply(controls, InOrder(order), model, 1 / 60)
        seen.append(controls.surface_faults)
    assert seen[0] == seen[1] != {}


def test_every_kind_of_the_service_breaks_a_surface_in_the_model() -> None:
    assert {kind.value for kind in SurfaceFaultKind} == set(SURFACE_FAILURE_KINDS)
    failures, controls = Failures(create_model("fixed_wing")), Controls()
    for kind in SURFACE_FAILURE_KINDS:
        value = 0.5 if kind in ("stuck", "reduced", "slow") else None
        failures.act({"name": "aileron1_wing2_left", "kind": kind, "value": value, "clear": False})
        failures.apply(controls, 1 / 60)
        assert controls.surface_faults["wing2l_ail1"].kind.value == kind
    with pytest.raises(NotFlownError, match="kind is missing"):  # of FAILURE_KINDS the one that is for other parts
        failures.act({"name": "aileron1_wing2_left", "kind": FAILURE_KINDS[-1], "value": None, "clear": False})


@pytest.mark.parametrize(("rate_deg_s", "moved_deg"), [(3.0, 0.3), (150.0, 7.0)])
def test_a_slow_surface_moves_at_the_rate_of_the_request(rate_deg_s: float, moved_deg: float) -> None:
    """In 0.1 s by a tenth of `value` [deg/s], as in SetFailure, and no faster than a healthy one: 70 deg/s."""
    model = create_model("fixed_wing")
    failures, controls = Failures(model), model.reset(InitialState())
    name = "wing2l_ail1"
    before = model.step(1 / 60, controls).surfaces_deg[name]
    failures.act({"name": "aileron1_wing2_left", "kind": "slow", "value": rate_deg_s, "clear": False})
    controls.roll = 1.0
    for _ in range(6):
        after = model.step(1 / 60, failures.apply(controls, 1 / 60)).surfaces_deg[name]
    assert abs(after - before) == pytest.approx(moved_deg)


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("slow", None),
        ("slow", 0.0),
        ("reduced", None),
        ("reduced", 1.5),
        ("stuck", 120.0),
        ("hard_over_up", 5.0),
        ("gone", 0.0),
    ],
)
def test_a_value_that_tx_node_refuses_is_refused_in_process(kind: str, value: object) -> None:
    with pytest.raises(NotFlownError, match=f"value is {value}; expected"):
        Failures(create_model("fixed_wing")).act(
            {"name": "aileron1_wing2_left", "kind": kind, "value": value, "clear": False}
        )


def test_levers_fly_again_when_motors_are_no_longer_commanded() -> None:
    aircraft = Aircraft(Conditions("multirotor", mode=AUTO))
    for _ in range(30):
        assert aircraft.command(AUTO, {"motors": [0.41] * 4}) is None
        aircraft.step()
    assert aircraft.controls.override_throttles
    assert aircraft.controls.throttle_use[:4] == pytest.approx([0.41] * 4)
    aircraft.set_mode(MANUAL, "pilot")
    aircraft.command(MANUAL, {"throttle": 0.8})
    aircraft.step()
    assert not aircraft.controls.override_throttles
    assert aircraft.controls.throttle[:4] == pytest.approx([0.41] * 4, abs=0.03)  # no jump
    for _ in range(120):  # longer than the transition
        assert aircraft.command(MANUAL, {"throttle": 0.8}) is None
        aircraft.step()
    assert aircraft.controls.throttle[:4] == pytest.approx([0.8] * 4)
    assert [engine.throttle for engine in aircraft.state.engines[:4]] == pytest.approx([0.8] * 4, abs=0.2)


def test_surfaces_have_the_names_of_the_core() -> None:
    """As tests/cpp/core/surfaces/test_surfaces.cpp has them: each leads to X-Plane's dataref of it."""
    assert len(SURFACES) == len(set(SURFACES.values())) == 96
    assert SURFACES["aileron1_wing2_left"] == "wing2l_ail1"
    assert SURFACES["speedbrake2_wing2_left"] == "wing2l_sbrk2"
    assert SURFACES["yaw_brake_wing3_left"] == "wing3l_yawb"
    assert SURFACES["elevator1_right"] == "hstab2_elv1"
    assert SURFACES["elevator2_wing3_right"] == "wing3r_elv2"
    assert SURFACES["rudder2_fin1"] == "vstab1_rud2"
    known = datarefs("12.10")
    for own in SURFACES.values():
        assert "sbrk" in own or f"sim/flightmodel/controls/{own}def" in known


def test_the_view_is_what_the_emulator_sends() -> None:
    """Every field that X-Plane has a dataref for, by lib/core/state/sources.txt, against the emulator's own tables."""
    simulator = Simulator(create_model, "fixed_wing", initial=InitialState(heading_deg=30.0, airspeed_mps=70.0))
    simulator.settings.set_weather(Weather(200.0, 7.0, 1.0))
    simulator.inputs._pilot = None
    for _ in range(60):
        simulator.step(1 / 60)
    view = FlightView(
        simulator.model.info, simulator.model.state, simulator.controls, simulator.frame.local, 60, 1 / 60
    )
    units = {
        "": 1.0,
        "negated": -1.0,
        "psf": 4.4482216152605 / 0.3048**2,
        "g, aft +": -1.0,
        "g, up +": 1.0,
        "g, right +": 1.0,
    }
    compared = 0
    section = (ROOT / "lib/core/state/sources.txt").read_text(encoding="utf-8").split("[FlightState: flight")[1]
    for line in section.split("\n[")[0].splitlines():
        columns = [column.strip() for column in line.split("|")]
        match = re.match(r"(sim/[^ ;{]+)(?: \(([^)]*)\))?(?=$|;)", columns[2]) if len(columns) > 2 else None
        if match is None or not hasattr(view, columns[0]) or match.group(2) not in (None, *units):
            continue
        sent = simulator.store.get(*_element(match.group(1))) * units[match.group(2) or ""]
        assert getattr(view, columns[0]) == pytest.approx(sent, rel=2e-7, abs=1e-6), columns[0]
        compared += 1
    assert compared >= 20


def _element(path: str) -> tuple:
    name, _, index = path.rstrip("]").partition("[")
    return name, int(index or 0)


def test_the_options_of_the_arbiter_are_those_of_the_files() -> None:
    options = arbiter_options("fixed_wing")
    assert options["engines"] == 2
    assert options["channels"]["flaps"] == {"slew": 0.5}
    assert options["command_timeout"] == 0.5
    assert core.ControlArbiter(options, 0.0).mode == 1


def test_modes_are_plain_numbers_of_the_message() -> None:
    assert (MANUAL, AUTO) == (FlightMode.MANUAL, FlightMode.AUTO)
    assert (type(MANUAL), type(AUTO)) == (int, int)


def test_the_truth_of_a_frame_is_every_number_in_doubles() -> None:
    model = create_model("fixed_wing", seed=1)
    controls = model.reset(InitialState(airspeed_mps=70.0))
    model.set_turbulence(1.0, seed=1)
    s = model.step(1 / 60, controls)
    numbers = (
        s.sim_time_s, s.latitude_deg, s.longitude_deg, s.altitude_m, *s.quaternion, s.p_rad_s, s.q_rad_s, s.r_rad_s,
        s.v_north_mps, s.v_east_mps, s.v_down_mps, s.alpha_rad, s.beta_rad, s.calibrated_airspeed_mps,
        s.wind_north_mps, s.wind_east_mps, s.wind_down_mps, s.mass_kg, *s.surfaces_deg.values(),
        *[engine.thrust_n for engine in s.engines], *[engine.rpm for engine in s.engines],
    )  # fmt: skip
    assert len(set(numbers)) > 20
    assert core.truth_bytes(s) == struct.pack(f"={len(numbers)}d", *numbers)


def test_a_slot_of_another_type_is_no_number_of_this_one() -> None:
    class View:
        __slots__ = ()
        sim_time_s = vars(ModelState)["sim_time_s"]  # Python itself refuses it

    with pytest.raises(TypeError, match="sim_time_s"):
        core.truth_bytes(View())


def test_a_type_whose_attributes_cannot_be_looked_up_leaves_nothing_behind() -> None:
    class Lookups(type):
        asked = 0

        def __getattr__(cls, name: str) -> object:
            Lookups.asked += 1
            if Lookups.asked > 1:
                raise RuntimeError("no more")
            return None

    class View(metaclass=Lookups):
        __slots__ = ()

    core.truth_bytes(create_model("fixed_wing").state)  # the places in a state are known
    for _ in range(2):
        Lookups.asked = 0
        with pytest.raises((RuntimeError, AttributeError)):
            core.truth_bytes(View())


def test_a_number_beyond_float32_is_no_view() -> None:
    model = create_model("fixed_wing")
    controls = model.reset(InitialState(airspeed_mps=70.0))
    model.state.p_rad_s = 1e39
    with pytest.raises(OverflowError, match="too large"):
        FlightView(model.info, model.state, controls, LocalFrame(37.5, 127.0), 60, 1 / 60)


def test_a_module_built_without_eigen_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "core", object())
    with pytest.raises(compiled.NotCompiledError, match=r"was built without Eigen's headers: .*libeigen3-dev"):
        Aircraft(Conditions("fixed_wing"))
