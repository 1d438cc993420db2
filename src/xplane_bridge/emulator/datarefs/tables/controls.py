"""Stick, trims, handles, control surfaces and the overrides."""

from __future__ import annotations

from functools import partial
from typing import Callable, Dict, List, Optional, Sequence

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.flight.flight_model import SurfaceKind, SurfaceSpec
from xplane_bridge.emulator.flight.frame import Frame

_CONTROLS = "sim/flightmodel/controls/"
_COCKPIT = "sim/cockpit2/controls/"
_CONTROLS2 = "sim/flightmodel2/controls/"

#: Wing parts in the order of X-Plane's arrays; tailplanes and fins follow them.
WINGS = tuple(f"wing{number}{side}" for number in (1, 2, 3, 4) for side in "lr")
#: Elevons and canards. No aircraft of the emulator has any.
WING_ELEVATORS = tuple(f"sim/flightmodel/controls/{wing}_elv{number}def" for number in (1, 2) for wing in WINGS)
PARTS = (*WINGS, "hstab1", "hstab2", "vstab1", "vstab2")
#: Place of the first of PARTS in the old arrays `sim/flightmodel/controls/*_def`: eight propellers come before. The
#: arrays `sim/flightmodel2/wing/*_deg` begin with it.
_FIRST_PART = 8

_WING_LEAVES = ("ail1", "ail2", "spo1", "spo2", "fla1", "fla2", "yawb")
#: Arrays by part: leaf of the single dataref -> array under sim/flightmodel2/wing/.
_ARRAYS = {
    "ail1": "aileron1_deg",
    "ail2": "aileron2_deg",
    "spo1": "spoiler1_deg",
    "spo2": "spoiler2_deg",
    "fla1": "flap1_deg",
    "fla2": "flap2_deg",
    "sbrk1": "speedbrake1_deg",
    "sbrk2": "speedbrake2_deg",
    "yawb": "yawbrake_deg",
    "elv1": "elevator1_deg",
    "elv2": "elevator2_deg",
    "rud1": "rudder1_deg",
    "rud2": "rudder2_deg",
}
_OLD_ARRAYS = {"ail1": "ail1_def", "ail2": "ail2_def", "elv1": "elv1_def", "rud1": "rudd_def", "fla1": "fla1_def"}
#: Datarefs of one surface a side of X-Plane 9's naming: (leaf of the set, side) by name. See `old_names`.
_OLD_NAMES = {
    "lail1def": ("ail1", "l"),
    "rail1def": ("ail1", "r"),
    "lail2def": ("ail2", "l"),
    "rail2def": ("ail2", "r"),
    "lsplrdef": ("spo1", "l"),
    "rsplrdef": ("spo1", "r"),
    "ldruddef": ("yawb", "l"),
    "rdruddef": ("yawb", "r"),
}

OVERRIDES = (
    "joystick",
    "joystick_pitch",
    "joystick_roll",
    "joystick_heading",
    "artstab",
    "flightcontrol",
    "throttles",
    "control_surfaces",
    "gearbrake",
    "toe_brakes",
    "wheel_steer",
    "prop_pitch",
    "prop_mode",
    "mixture",
    "forces",
    "wing_forces",
    "engine_forces",
    "gear_forces",
    "engines",
    "torque_motors",
    "fuel_flow",
    "itt_egt",
    "cht_oilt",
    "ias",
    "autopilot",
    "flightdir",
    "timestep",
    "camera",
    "TCAS",
    "groundplane",
    "navneedles",
    "planepath",
    "plane_ai_autopilot",
    "boats",
    "clouds",
)


def surface_dataref(spec: SurfaceSpec) -> str:
    """Path (with index, for arrays) of the dataref that shows a surface of the flight model."""
    part, _, leaf = spec.name.partition("_")
    if spec.kind is SurfaceKind.SPEED_BRAKE:
        return f"sim/flightmodel2/wing/{_ARRAYS.get(leaf, 'speedbrake1_deg')}[{PARTS.index(part)}]"
    return f"{_CONTROLS}{spec.name}def"


def define(table: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    _surfaces(table, sim)
    _stick(table, sim)
    _handles(table)
    _limits(table, sim)
    for name in OVERRIDES:
        table.setting(f"sim/operation/override/override_{name}")


def _surfaces(t: Table, sim: Sources) -> None:
    single: Dict[str, List[str]] = {leaf: [] for leaf in _ARRAYS}
    for leaf in _WING_LEAVES:
        single[leaf] = [f"{_CONTROLS}{wing}_{leaf}def" for wing in WINGS]
    for number in (1, 2):
        single[f"elv{number}"] = [f"{_CONTROLS}hstab{half}_elv{number}def" for half in (1, 2)]
        single[f"rud{number}"] = [f"{_CONTROLS}vstab{fin}_rud{number}def" for fin in (1, 2)]
    for names in single.values():
        for name in names:
            t.setting(name)
    for name in WING_ELEVATORS:
        t.setting(name)
        sim.watch_surface(name)
    for leaf, name in _ARRAYS.items():
        array = f"sim/flightmodel2/wing/{name}"
        if single[leaf]:
            start = {"elv": 8, "rud": 10}.get(leaf[:3], 0)
            t.store.add_view(array, _padded(t.store, array, single[leaf], start))
        else:
            t.setting(array)
        single[leaf] = single[leaf] or [f"{array}[{part}]" for part in range(len(WINGS))]
        sim.watch_surface(array)
        if leaf in _OLD_ARRAYS:
            start = _FIRST_PART + {"elv": 8, "rud": 10}.get(leaf[:3], 0)
            old = _CONTROLS + _OLD_ARRAYS[leaf]
            t.store.add_view(old, _padded(t.store, old, single[leaf], start))
            sim.watch_surface(old)
    for leaf in ("ail1", "ail2", "spo1", "spo2", "fla1", "fla2", "yawb", "elv1", "elv2", "rud1", "rud2"):
        for name in single[leaf]:
            sim.watch_surface(name)
    for name in _OLD_NAMES:
        t.setting(_CONTROLS + name)
        sim.watch_surface(_CONTROLS + name)


def _padded(store: DatarefStore, array: str, names: List[str], start: int) -> List[str]:
    """The elements of an array of X-Plane's that shows these datarefs from its element `start` on."""
    rest = store.add(f"_emulator/no_surface/{array}", size=store.elements(array) - len(names))
    nothing = [f"{rest.name}[{index}]" for index in range(len(rest.slots))]
    return nothing[:start] + names + nothing[start:]


def old_names(surfaces: Sequence[SurfaceSpec]) -> Dict[str, str]:
    """X-Plane 9's datarefs, and which of an aircraft's surfaces each shows: that of the first wing that has one."""
    out: Dict[str, str] = {}
    for name, (leaf, side) in _OLD_NAMES.items():
        for spec in surfaces:
            part, _, its_leaf = spec.name.partition("_")
            if its_leaf == leaf and part.startswith("wing") and part.endswith(side):
                out.setdefault(_CONTROLS + name, spec.name)
    return out


def _stick(t: Table, sim: Sources) -> None:
    for axis, trim, total, stick in (
        ("pitch", "elevator", lambda f: f.m.pitch_ratio, lambda: sim.controls.pitch),
        ("roll", "aileron", lambda f: f.m.roll_ratio, lambda: sim.controls.roll),
        ("heading", "rudder", lambda f: f.m.yaw_ratio, lambda: sim.controls.yaw),
    ):
        t.setting(f"sim/joystick/yoke_{axis}_ratio")
        t.alias(f"{_COCKPIT}yoke_{axis}_ratio", f"sim/joystick/yoke_{axis}_ratio")
        t.value(
            f"sim/joystick/artstab_{axis}_ratio", partial(lambda after, before, f: after(f) - before(), total, stick)
        )
        t.setting(f"sim/joystick/servo_{axis}_ratio")
        t.setting(f"sim/joystick/joystick_{axis}_sensitivity", 0.5)
        t.setting(f"sim/joystick/joystick_{axis}_nullzone")
        t.value(f"{_COCKPIT}total_{axis}_ratio", _total(sim, total))
        if not sim.totals_move:  # the stick when the surfaces were taken: known also where it is asked for later
            t.store.watch(t.store.dataref(f"{_COCKPIT}total_{axis}_ratio").slots)
        t.value(f"{_CONTROLS2}{axis}_ratio", total)
        t.setting(f"{_COCKPIT}{trim}_trim")
        t.alias(f"{_CONTROLS2}{trim}_trim", f"{_COCKPIT}{trim}_trim")
        t.alias(f"{_CONTROLS}{trim[:3] if trim != 'elevator' else 'elv'}_trim", f"{_COCKPIT}{trim}_trim")
    t.setting("sim/cockpit2/switches/artificial_stability_on", 1)
    t.setting("sim/cockpit2/switches/yaw_damper_on")
    t.setting("sim/joystick/has_joystick")
    t.setting("sim/joystick/joystick_axis_values", 0.5)
    for name in ("axis_assignments", "axis_reverse", "button_values"):
        t.setting(f"sim/joystick/joystick_{name}")


def _total(sim: Sources, total: Callable[[Frame], float]) -> Callable[[Frame], float]:
    """The stick that the surfaces get; with `--overridden-totals frozen` it stands while a client has taken them."""
    held = [0.0]

    def shown(frame: Frame) -> float:
        if sim.totals_move or not sim.controls.override_surfaces:
            held[0] = total(frame)
        return held[0]

    return shown


def _handles(t: Table) -> None:
    t.setting(_COCKPIT + "flap_ratio")
    t.alias(_COCKPIT + "flap_handle_request_ratio", _COCKPIT + "flap_ratio")
    t.alias(_CONTROLS + "flaprqst", _COCKPIT + "flap_ratio")
    t.value(_COCKPIT + "flap_handle_deploy_ratio", lambda f: f.m.flap_ratio)
    t.value(_COCKPIT + "flap_system_deploy_ratio", lambda f: f.m.flap_ratio)
    t.value(_CONTROLS + "flaprat", lambda f: f.m.flap_ratio)
    t.value(_CONTROLS + "flap2rat", lambda f: f.m.flap_ratio)
    t.value(_CONTROLS + "slatrat", lambda f: f.m.slat_ratio)
    for name in ("flap1_deploy_ratio", "flap2_deploy_ratio", "flap_handle_deploy_ratio"):
        t.value(_CONTROLS2 + name, lambda f: f.m.flap_ratio)
    for name in ("slat1_deploy_ratio", "slat2_deploy_ratio"):
        t.value(_CONTROLS2 + name, lambda f: f.m.slat_ratio)
    t.setting(_COCKPIT + "speedbrake_ratio")
    t.alias(_CONTROLS + "sbrkrqst", _COCKPIT + "speedbrake_ratio")
    t.value(_CONTROLS + "sbrkrat", lambda f: f.m.speed_brake_ratio)
    t.value(_CONTROLS2 + "speedbrake_ratio", lambda f: f.m.speed_brake_ratio)
    t.setting(_COCKPIT + "gear_handle_down")
    t.alias("sim/cockpit/switches/gear_handle_status", _COCKPIT + "gear_handle_down")
    t.setting(_COCKPIT + "parking_brake_ratio")
    t.alias(_CONTROLS + "parkbrake", _COCKPIT + "parking_brake_ratio")
    t.setting(_COCKPIT + "left_brake_ratio")
    t.setting(_COCKPIT + "right_brake_ratio")
    t.alias(_CONTROLS + "l_brake_add", _COCKPIT + "left_brake_ratio")
    t.alias(_CONTROLS + "r_brake_add", _COCKPIT + "right_brake_ratio")
    t.setting(_COCKPIT + "thrust_vector_ratio")
    t.alias(_CONTROLS + "vectrqst", _COCKPIT + "thrust_vector_ratio")
    t.value(_CONTROLS2 + "thrust_vector_ratio", lambda f: f.m.thrust_vector_ratio)
    for name in ("wingsweep", "dihedral", "incidence", "wing_retraction"):
        t.setting(f"{_COCKPIT}{name}_ratio")


def _limits(t: Table, sim: Sources) -> None:
    limits = "sim/aircraft/controls/acf_"

    def travel(leaf: str, low: bool) -> float:
        spec = _spec(sim, leaf)
        if spec is None:
            return 0.0
        return -spec.minimum_deg if low else spec.maximum_deg

    for leaf, name in (("ail1", "ail1"), ("ail2", "ail2"), ("elv1", "elev")):
        t.value(f"{limits}{name}_up", partial(lambda part, _: travel(part, True), leaf))
        t.value(f"{limits}{name}_dn", partial(lambda part, _: travel(part, False), leaf))
    t.value(limits + "rudd_lr", lambda _: travel("rud1", True))
    t.value(limits + "rudd_rr", lambda _: travel("rud1", False))
    t.value(limits + "splr_up", lambda _: 0.0)
    t.value(limits + "sbrk_up", lambda _: travel("spo1", False))
    t.value(limits + "flap_detents", lambda f: f.info.flap_detents)
    t.value("sim/aircraft/gear/acf_gear_retract", lambda f: f.info.retractable_gear)
    t.value("sim/aircraft/vtolcontrols/acf_vectEQ", lambda f: f.info.hover_thrust_vector is not None)
    t.value("sim/aircraft2/metadata/is_vtol", lambda f: f.info.hover_thrust_vector is not None)
    t.value("sim/aircraft2/metadata/is_helicopter", lambda _: False)
    trims = {"ailn": ("aileron", "ail1"), "elev": ("elevator", "elv1"), "rudd": ("rudder", "rud1")}
    for name, (kind, leaf) in trims.items():
        for end in ("max", "min"):
            t.value(f"{limits}{end}_trim_{name}", partial(_trim_part, sim, kind, leaf, end))
    for end in ("up", "dn"):
        t.setting(f"{limits}hstb_trim_{end}")  # no aircraft here has a stabiliser that trims


def _spec(sim: Sources, leaf: str) -> Optional[SurfaceSpec]:
    return next((spec for spec in sim.model.surfaces if spec.name.endswith("_" + leaf)), None)


def _trim_part(sim: Sources, kind: str, leaf: str, end: str, _: Frame) -> float:
    """Part of its travel that full trim, nose up or right (`max`) or down or left, moves the surface (of two: down)."""
    spec = _spec(sim, leaf)
    if spec is None:
        return 0.0
    trim, travel = dict(sim.model.info.trim_deg).get(kind, 0.0), spec.maximum_deg
    if spec.kind is SurfaceKind.ELEVATOR and end == "max":
        travel = -spec.minimum_deg
    return abs(trim) / travel if travel else 0.0
