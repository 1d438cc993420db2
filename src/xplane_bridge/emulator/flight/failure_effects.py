"""What failed equipment (`rel_*`) does to the controls that reach the flight model."""

from __future__ import annotations

import re
from typing import Callable, Dict, Set

from xplane_bridge.emulator.flight.flight_model import (
    Controls,
    EngineFault,
    FlightModel,
    Side,
    SurfaceFault,
    SurfaceFaultKind,
    SurfaceKind,
)

_TRIM_RUNAWAY_PER_S = 0.05
#: Of trims that stand, or run away.
TRIM_FAILURES = frozenset(
    name for leaf in ("ail", "elv", "rud") for name in (f"rel_trim_{leaf}", f"rel_{leaf}_trim_run")
)

_EVENTS = {
    "lock": SurfaceFaultKind.STUCK,
    "mxdn": SurfaceFaultKind.HARD_OVER_DOWN,
    "mxup": SurfaceFaultKind.HARD_OVER_UP,
    "cntr": SurfaceFaultKind.CENTRED,
    "gone": SurfaceFaultKind.GONE,
}
_LEAVES = {"ailn": "ail", "elev": "elv", "rudd": "rud", "rspo": "spo", "flap": "fla", "sbrk": "sbrk", "yawb": "yawb"}
_ENGINE = re.compile(r"rel_(?:engfai|engfla|engsep|fuelfl|seize_)(\d+)")
_SURFACES = re.compile(r"rel_(fcon_.*|fc_[LR]_flp|[LR]_flp_off)")
#: What else acts on controls.
_CONTROLS = re.compile(
    r"rel_(stbaug|conlock|(ail|elv|rud)_[LR]_jam|(ail|elv|rud)_trim_run|trim_(ail|elv|rud)|flap_act|gear_act|[lr]brakes"
    r"|throt_lo|throt_hi|fc_thr|(fc_)?((ail|rud)_[LR]|elv_[UD])[12]?)"
)
_SIDES = {"lft": Side.LEFT, "rgt": Side.RIGHT, "ctr": Side.CENTRE}


class FailureEffects:
    """Applies failures to controls, and remembers where what they hold was caught.

    Args:
        surfaces_break: Whether `rel_fcon_*` act.
    """

    def __init__(self, surfaces_break: bool = True) -> None:
        self._surfaces_break = surfaces_break
        self._frozen: Dict[str, float] = {}

    def start(self) -> None:
        """A flight begins: what is failed holds its controls, not those of the flight before."""
        self._frozen.clear()

    def apply(self, controls: Controls, failed: Set[str], model: FlightModel, dt: float) -> None:
        """Changes the frame's controls as the failures do.

        Args:
            controls: Of this frame.
            failed: Leaves (`rel_...`) of everything that is failed now.
            model: Whose surfaces and engines they are.
            dt: Of the frame [s].
        """
        if not failed:
            controls.surface_faults, controls.stability_fault, controls.gear_fault = {}, False, False
            controls.engine_faults = [EngineFault.NONE] * len(controls.engine_faults)
            self._frozen.clear()
            return
        acting = failed if self._surfaces_break else {leaf for leaf in failed if not leaf.startswith("rel_fcon_")}
        controls.surface_faults = self._surface_faults(acting, model)
        engines = model.info.engine_count
        controls.engine_faults = [self._engine_fault(i, failed) for i in range(len(controls.engine_faults))]
        controls.stability_fault, controls.gear_fault = "rel_stbaug" in failed, "rel_gear_act" in failed
        self._limit_stick(controls, failed)
        lock = "rel_conlock" in failed
        self._freeze(controls, "roll", lock or bool(failed & {"rel_ail_L_jam", "rel_ail_R_jam"}))
        self._freeze(controls, "pitch", lock or bool(failed & {"rel_elv_L_jam", "rel_elv_R_jam"}))
        self._freeze(controls, "yaw", lock or bool(failed & {"rel_rud_L_jam", "rel_rud_R_jam"}))
        for attribute, leaf in (("trim_roll", "ail"), ("trim_pitch", "elv"), ("trim_yaw", "rud")):
            if f"rel_{leaf}_trim_run" in failed:
                value = self._frozen.setdefault(attribute, getattr(controls, attribute)) + _TRIM_RUNAWAY_PER_S * dt
                self._frozen[attribute] = min(value, 1.0)
                setattr(controls, attribute, self._frozen[attribute])
            else:
                self._freeze(controls, attribute, f"rel_trim_{leaf}" in failed)
        if "rel_flap_act" in failed:  # where they are, not where the handle is: what droops as flaps do stops as well
            controls.flap_request = self._frozen.setdefault("flap_request", model.state.flap_ratio)
        else:
            self._frozen.pop("flap_request", None)
        self._fail_brakes(controls, failed)
        for i in range(engines):
            if "rel_throt_lo" in failed:
                controls.throttle[i] = 0.0
            elif "rel_throt_hi" in failed:
                controls.throttle[i] = 1.0
            elif "rel_fc_thr" in failed:
                controls.throttle[i] = self._frozen.setdefault(f"throttle{i}", controls.throttle[i])
            else:
                self._frozen.pop(f"throttle{i}", None)

    @staticmethod
    def acts(leaf: str, model: FlightModel) -> bool:
        """Whether a failure of this name does anything to this aircraft."""
        engine = _ENGINE.fullmatch(leaf)
        if engine:
            return int(engine.group(1)) < model.info.engine_count
        if _SURFACES.fullmatch(leaf):
            return bool(FailureEffects._surface_faults({leaf}, model))
        return bool(_CONTROLS.fullmatch(leaf))

    def _freeze(self, controls: Controls, attribute: str, failed: bool) -> None:
        if failed:
            setattr(controls, attribute, self._frozen.setdefault(attribute, getattr(controls, attribute)))
        else:
            self._frozen.pop(attribute, None)

    @staticmethod
    def _fail_brakes(controls: Controls, failed: Set[str]) -> None:
        """A side that has failed brakes neither by its pedal nor by the parking brake, which the other side keeps."""
        sides = (("rel_lbrakes", "brake_left"), ("rel_rbrakes", "brake_right"))
        if not any(leaf in failed for leaf, _ in sides):
            return
        for leaf, pedal in sides:
            force = 0.0 if leaf in failed else max(getattr(controls, pedal), controls.parking_brake)
            setattr(controls, pedal, force)
        controls.parking_brake = 0.0

    @staticmethod
    def _limit_stick(controls: Controls, failed: Set[str]) -> None:
        """`rel_fc_ail_L` and the like: no authority to this side. The names without `fc_` are X-Plane 12's."""

        def lost(*leaves: str) -> bool:
            return any(f"rel_{leaf}{suffix}" in failed for leaf in leaves for suffix in ("", "1", "2"))

        if lost("fc_ail_L", "ail_L"):
            controls.roll = max(controls.roll, 0.0)
        if lost("fc_ail_R", "ail_R"):
            controls.roll = min(controls.roll, 0.0)
        if lost("fc_elv_U", "elv_U"):
            controls.pitch = min(controls.pitch, 0.0)
        if lost("fc_elv_D", "elv_D"):
            controls.pitch = max(controls.pitch, 0.0)
        if lost("fc_rud_L", "rud_L"):
            controls.yaw = max(controls.yaw, 0.0)
        if lost("fc_rud_R", "rud_R"):
            controls.yaw = min(controls.yaw, 0.0)

    @staticmethod
    def _engine_fault(engine: int, failed: Set[str]) -> EngineFault:
        if f"rel_seize_{engine}" in failed:
            return EngineFault.SEIZED
        stops = ("engfai", "engfla", "engsep", "fuelfl")
        return EngineFault.STOPPED if any(f"rel_{stem}{engine}" in failed for stem in stops) else EngineFault.NONE

    @staticmethod
    def _surface_faults(failed: Set[str], model: FlightModel) -> Dict[str, SurfaceFault]:
        faults: Dict[str, SurfaceFault] = {}

        def set_all(kind: SurfaceFaultKind, matching: Callable[..., bool]) -> None:
            for spec in model.surfaces:
                if matching(spec):
                    faults[spec.name] = SurfaceFault(kind)

        if "rel_flap_act" in failed:
            set_all(SurfaceFaultKind.STUCK, lambda s: s.kind is SurfaceKind.FLAP)
        for side, letter in ((Side.LEFT, "L"), (Side.RIGHT, "R")):
            if f"rel_fc_{letter}_flp" in failed:
                set_all(SurfaceFaultKind.STUCK, lambda s, side=side: s.kind is SurfaceKind.FLAP and s.side is side)
            if f"rel_{letter}_flp_off" in failed:
                set_all(SurfaceFaultKind.GONE, lambda s, side=side: s.kind is SurfaceKind.FLAP and s.side is side)
        for leaf in sorted(failed):  # of several on one surface always the same one acts
            parts = leaf.split("_")
            if parts[:2] != ["rel", "fcon"]:
                continue
            if len(parts) != 6 or parts[2] not in _LEAVES or parts[4] not in _SIDES or parts[5] not in _EVENTS:
                continue
            _, _, kind, number, where, event = parts
            suffix = _LEAVES[kind] + number.replace("x", "")
            set_all(_EVENTS[event], lambda s, x=suffix, y=_SIDES[where]: _matches(s.name, x) and s.side is y)
        return faults


def _matches(name: str, leaf: str) -> bool:
    return name.endswith("_" + leaf)
