"""The datarefs that the doctor reads; it writes none."""

from __future__ import annotations

VERSION = "sim/version/xplane_internal_version"
RUNNING_TIME = "sim/time/total_running_time_sec"
PAUSED = "sim/time/paused"
REPLAY = "sim/time/is_in_replay"
#: Datagrams of Data Output rows a second [Hz].
DATA_RATE = "sim/network/dataout/network_data_rate"
#: Which rows go to the network; an element for each row.
DATA_ROWS = "sim/network/dataout/data_to_internet"

BASIC = (VERSION, RUNNING_TIME, PAUSED, REPLAY, DATA_RATE)

#: What the bridge overrides while it flies.
BRIDGE_OVERRIDES = (
    "sim/operation/override/override_joystick",
    "sim/operation/override/override_joystick_roll",
    "sim/operation/override/override_joystick_pitch",
    "sim/operation/override/override_joystick_heading",
    "sim/operation/override/override_throttles",
    "sim/operation/override/override_toe_brakes",
    "sim/operation/override/override_control_surfaces",
)
#: Stops the flight model of the user's aircraft: a program moves it.
PATH_OVERRIDE = "sim/operation/override/override_planepath[0]"
#: Overrides of X-Plane 11.40 and all later ones that keep a flight from answering as expected.
OTHER_OVERRIDES = (
    "sim/operation/override/override_artstab",
    "sim/operation/override/override_autopilot",
    "sim/operation/override/override_camera",
    "sim/operation/override/override_engine_forces",
    "sim/operation/override/override_engines",
    "sim/operation/override/override_flightcontrol",
    "sim/operation/override/override_flightdir",
    "sim/operation/override/override_flightdir_ptch",
    "sim/operation/override/override_flightdir_roll",
    "sim/operation/override/override_forces",
    "sim/operation/override/override_fuel_flow",
    "sim/operation/override/override_gear_forces",
    "sim/operation/override/override_gearbrake",
    "sim/operation/override/override_groundplane",
    "sim/operation/override/override_ias",
    "sim/operation/override/override_mixture",
    "sim/operation/override/override_prop_mode",
    "sim/operation/override/override_prop_pitch",
    "sim/operation/override/override_timestep",
    "sim/operation/override/override_torque_motors",
    "sim/operation/override/override_wheel_steer",
    "sim/operation/override/override_wing_forces",
)
OVERRIDES = (*BRIDGE_OVERRIDES, PATH_OVERRIDE, *OTHER_OVERRIDES)


def data_row(index: int) -> str:
    """The dataref that says whether a row of the Data Output table goes to the network."""
    return f"{DATA_ROWS}[{index}]"
