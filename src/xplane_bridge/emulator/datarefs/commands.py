"""X-Plane commands (CMND) that the emulator knows; unknown ones do nothing, as in X-Plane.

Those that the list of the running version does not have are unknown to it as well.
"""

from __future__ import annotations

from functools import partial
from typing import Callable, Dict, Tuple

from xplane_bridge import xplane_names
from xplane_bridge.emulator.datarefs import camera
from xplane_bridge.emulator.datarefs.placement import PATH_OVERRIDE
from xplane_bridge.emulator.datarefs.sources import Actions
from xplane_bridge.emulator.datarefs.store import DatarefStore

_COCKPIT = "sim/cockpit2/controls/"
_FLAPS = _COCKPIT + "flap_ratio"
_VIEW = "sim/graphics/view/"
_TRIM_STEP = 0.01
_THROTTLE_STEP = 0.05

#: View commands: (view_type, whether external).
VIEWS: Dict[str, Tuple[int, bool]] = {
    "default_view": (camera.PANEL, False),
    "forward_with_2d_panel": (camera.PANEL, False),
    "forward_with_hud": (camera.HUD, False),
    "forward_with_nothing": (camera.NOTHING, False),
    "3d_cockpit_cmnd_look": (camera.COCKPIT_3D, False),
    "tower": (camera.TOWER, True),
    "runway": (camera.RUNWAY, True),
    "chase": (camera.CHASE, True),
    "circle": (camera.CIRCLE, True),
    "still_spot": (camera.STILL_SPOT, True),
    "linear_spot": (camera.LINEAR_SPOT, True),
    "free_camera": (camera.FREE, True),
    "ridealong": (camera.RIDE_ALONG, True),
}
#: Glances: a press holds one until another view is chosen, or springs back at once [? glance-holds].
GLANCES = {"back": camera.BACK, "straight_down": camera.STRAIGHT_DOWN}


def commands(sim: Actions) -> Dict[str, Callable[[], None]]:
    """What each command of the running version does."""
    listed = xplane_names.commands(sim.version)
    return {name: action for name, action in all_commands(sim).items() if name in listed}


def all_commands(sim: Actions) -> Dict[str, Callable[[], None]]:
    """What the commands of all versions do."""
    store = sim.store

    def setter(name: str, value: float) -> Callable[[], None]:
        return lambda: store.set(name, value)

    def stepper(name: str, step: float, low: float, high: float) -> Callable[[], None]:
        return lambda: store.set(name, min(max(store.get(name) + step, low), high))

    def toggle(name: str) -> Callable[[], None]:
        return partial(_toggle, store, name)

    table: Dict[str, Callable[[], None]] = {
        "sim/operation/pause_on": lambda: sim.pause(True),
        "sim/operation/pause_off": lambda: sim.pause(False),
        "sim/operation/pause_toggle": lambda: sim.pause(not sim.clocks.paused),
        "sim/operation/fix_all_systems": sim.repair_all,
        "sim/operation/reset_flight": sim.restart_flight,
        "sim/operation/freeze_toggle": toggle(PATH_OVERRIDE),
        "sim/flight_controls/landing_gear_down": setter(_COCKPIT + "gear_handle_down", 1.0),
        "sim/flight_controls/landing_gear_up": setter(_COCKPIT + "gear_handle_down", 0.0),
        "sim/flight_controls/landing_gear_toggle": toggle(_COCKPIT + "gear_handle_down"),
        "sim/flight_controls/flaps_up": partial(_move_flaps, sim, -1),
        "sim/flight_controls/flaps_down": partial(_move_flaps, sim, 1),
        "sim/flight_controls/speed_brakes_up_all": setter(_COCKPIT + "speedbrake_ratio", 0.0),  # retracts them
        "sim/flight_controls/speed_brakes_down_all": setter(_COCKPIT + "speedbrake_ratio", 1.0),
        "sim/flight_controls/speed_brakes_toggle": toggle(_COCKPIT + "speedbrake_ratio"),
        "sim/flight_controls/brakes_toggle_max": toggle(_COCKPIT + "parking_brake_ratio"),
        "sim/flight_controls/brakes_toggle_regular": toggle(_COCKPIT + "parking_brake_ratio"),
        "sim/flight_controls/pitch_trim_up": stepper(_COCKPIT + "elevator_trim", _TRIM_STEP, -1.0, 1.0),
        "sim/flight_controls/pitch_trim_down": stepper(_COCKPIT + "elevator_trim", -_TRIM_STEP, -1.0, 1.0),
        "sim/flight_controls/pitch_trim_takeoff": setter(_COCKPIT + "elevator_trim", 0.0),
        "sim/flight_controls/aileron_trim_center": setter(_COCKPIT + "aileron_trim", 0.0),
        "sim/flight_controls/rudder_trim_center": setter(_COCKPIT + "rudder_trim", 0.0),
        "sim/engines/throttle_up": lambda: sim.move_throttles(_THROTTLE_STEP),
        "sim/engines/throttle_down": lambda: sim.move_throttles(-_THROTTLE_STEP),
        "sim/engines/throttle_full": lambda: sim.move_throttles(1.0),
        "sim/engines/engage_starters": sim.start_engines,
        "sim/operation/auto_start": sim.start_engines,
        "sim/operation/quick_start": sim.start_engines,
        "sim/magnetos/magnetos_off": lambda: _turn_keys(sim, False),
        "sim/magnetos/magnetos_both": lambda: _turn_keys(sim, True),
    }
    for name, dataref in (
        ("lights/nav_lights", "navigation_lights_on"),
        ("lights/beacon_lights", "beacon_on"),
        ("lights/strobe_lights", "strobe_lights_on"),
        ("lights/landing_lights", "landing_lights_on"),
        ("lights/taxi_lights", "taxi_light_on"),
        ("systems/avionics", "avionics_power_on"),
    ):
        switch = "sim/cockpit2/switches/" + dataref
        table[f"sim/{name}_on"] = setter(switch, 1.0)
        table[f"sim/{name}_off"] = setter(switch, 0.0)
        table[f"sim/{name}_toggle"] = toggle(switch)
    for engine in range(sim.model.info.engine_count):
        table[f"sim/starters/engage_starter_{engine + 1}"] = partial(sim.start_engine, engine)
        table[f"sim/magnetos/magnetos_off_{engine + 1}"] = partial(sim.turn_key, engine, False)
        table[f"sim/magnetos/magnetos_both_{engine + 1}"] = partial(sim.turn_key, engine, True)
    if "glance-holds" not in sim.otherwise:
        for name, view in GLANCES.items():
            table[f"sim/view/{name}"] = partial(_look, sim, view, False)
        table["sim/view/straight_up"] = setter(camera.GLANCE_PITCH, 90.0)
    table.update(sim.autopilot_commands)
    for name, (view, external) in VIEWS.items():
        table[f"sim/view/{name}"] = partial(_look, sim, view, external)
    return table


def _toggle(store: DatarefStore, name: str) -> None:
    """Switches a dataref on or off; of an array the first element, as the others are not the user's aircraft's."""
    slot = store.dataref(name).slots[0]
    store.values[slot] = 0.0 if store.values[slot] else 1.0


def _move_flaps(sim: Actions, notches: int) -> None:
    """Moves the flap handle on from the notch that is nearest; an aircraft without flaps has none."""
    detents = sim.model.info.flap_detents
    if detents:
        notch = round(sim.store.get(_FLAPS) * detents) + notches
        sim.store.set(_FLAPS, min(max(notch, 0), detents) / detents)


def _turn_keys(sim: Actions, on: bool) -> None:
    """Turns the ignition keys of all engines."""
    for engine in range(sim.model.info.engine_count):
        sim.turn_key(engine, on)


def _look(sim: Actions, view: int, external: bool) -> None:
    """A new view, the pilot's head straight ahead where the aircraft's file puts it."""
    sim.store.set(_VIEW + "view_type", view)
    sim.store.set(_VIEW + "view_is_external", float(external))
    sim.store.set(camera.GLANCE_PITCH, 0.0)
    for angle in ("psi", "the", "phi"):
        sim.store.set(_VIEW + f"pilots_head_{angle}", 0.0)
    for axis in "xyz":
        sim.store.set(_VIEW + f"pilots_head_{axis}", sim.store.get(f"sim/aircraft/view/acf_pe{axis.upper()}"))
