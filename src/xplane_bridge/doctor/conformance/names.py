"""The datarefs and commands that the test card uses."""

from __future__ import annotations

_POSITION = "sim/flightmodel/position/"
_YOKE = "sim/joystick/yoke_"
_OVERRIDE = "sim/operation/override/override_"

# --- read ---
LATITUDE = _POSITION + "latitude"
LONGITUDE = _POSITION + "longitude"
ELEVATION = _POSITION + "elevation"
HEIGHT = _POSITION + "y_agl"
LATITUDE_OF_ORIGIN = _POSITION + "lat_ref"
LONGITUDE_OF_ORIGIN = _POSITION + "lon_ref"
#: Pitch, roll, heading against the axes at the scenery's origin, and against the local level.
ORIGIN_ANGLES = (_POSITION + "theta", _POSITION + "phi", _POSITION + "psi")
LEVEL_ANGLES = (_POSITION + "true_theta", _POSITION + "true_phi", _POSITION + "true_psi")
THETA, PHI, PSI = ORIGIN_ANGLES
TRUE_PITCH, TRUE_ROLL, TRUE_HEADING = LEVEL_ANGLES
MAGNETIC_HEADING = _POSITION + "mag_psi"
VARIATION = _POSITION + "magnetic_variation"
RATES_DEG_S = (_POSITION + "P", _POSITION + "Q", _POSITION + "R")
ACCELERATION = (_POSITION + "local_ax", _POSITION + "local_ay", _POSITION + "local_az")
AXIAL, SIDE = "sim/flightmodel/forces/g_axil", "sim/flightmodel/forces/g_side"
TRUE_AIRSPEED = _POSITION + "true_airspeed"
GROUND_SPEED = _POSITION + "groundspeed"
BETA = _POSITION + "beta"
SLIP = "sim/cockpit2/gauges/indicators/slip_deg"
HPATH = _POSITION + "hpath"
FLIGHT_TIME = "sim/time/total_flight_time_sec"
RUNNING_TIME = "sim/time/total_running_time_sec"
FRAME_PERIOD = "sim/operation/misc/frame_rate_period"
ZULU = "sim/time/zulu_time_sec"
PAUSED = "sim/time/paused"
EARTH_RADIUS = "sim/physics/earth_radius_m"
STALL_SPEED_KT = "sim/aircraft/view/acf_Vs"
ENGINES = "sim/aircraft/engine/acf_num_engines"
ON_GROUND = "sim/flightmodel/failures/onground_any"
ALTIMETER = "sim/cockpit2/gauges/indicators/altitude_ft_pilot"
TOTAL_ROLL = "sim/cockpit2/controls/total_roll_ratio"
AILERONS = tuple(f"sim/flightmodel/controls/wing{wing}l_ail1def" for wing in (1, 2, 3, 4))
EMPTY_MASS = "sim/aircraft/weight/acf_m_empty"
FUEL_MASS = "sim/flightmodel/weight/m_fuel_total"
TOTAL_MASS = "sim/flightmodel/weight/m_total"
PROPELLER = "sim/flightmodel/engine/ENGN_prop[0]"
GENERATORS_OFF = "sim/cockpit2/annunciators/generator_off"
ALTITUDE_HOLD = "sim/cockpit2/autopilot/altitude_hold_status"
HYDRAULIC_PRESSURE = "sim/cockpit2/hydraulics/indicators/hydraulic_pressure_1"
VIEW_PITCH = "sim/graphics/view/view_pitch"
VIEW_HEADING = "sim/graphics/view/view_heading"
VIEW_TYPE = "sim/graphics/view/view_type"
#: Of `world_matrix`: the camera's backward direction in X-Plane's own axes.
CAMERA_BACK = tuple(f"sim/graphics/view/world_matrix[{i}]" for i in (2, 6, 10))
OTHER_LATITUDE = "sim/multiplayer/position/plane1_lat"
OTHER_LONGITUDE = "sim/multiplayer/position/plane1_lon"
OTHER_PLACE = tuple(f"sim/multiplayer/position/plane1_{axis}" for axis in "xyz")
OTHER_OVERRIDE = _OVERRIDE + "planepath[1]"

READ = tuple(
    path
    for value in list(globals().values())
    for path in ([value] if isinstance(value, str) else value if isinstance(value, tuple) else [])
    if path.startswith("sim/") and not path.endswith(("/", "_"))
)

# --- written ---
LOCAL_PLACE = (_POSITION + "local_x", _POSITION + "local_y", _POSITION + "local_z")
LOCAL_VELOCITY = (_POSITION + "local_vx", _POSITION + "local_vy", _POSITION + "local_vz")
QUATERNION = tuple(f"{_POSITION}q[{i}]" for i in range(4))
YOKE = (_YOKE + "roll_ratio", _YOKE + "pitch_ratio", _YOKE + "heading_ratio")
STICK_OVERRIDES = (_OVERRIDE + "joystick_roll", _OVERRIDE + "joystick_pitch", _OVERRIDE + "joystick_heading")
SURFACE_OVERRIDE = _OVERRIDE + "control_surfaces"
PAYLOAD = "sim/flightmodel/weight/m_fixed"
REVERSE_LEVER = "sim/cockpit2/engine/actuators/throttle_jet_rev_ratio[0]"
LEVER = "sim/cockpit2/engine/actuators/throttle_ratio[0]"
GENERATORS = "sim/cockpit2/electrical/generator_on"
VISUAL_OFFSET = "sim/graphics/view/field_of_view_vertical_deg"
WRITTEN = (
    *LOCAL_PLACE,
    *LOCAL_VELOCITY,
    *QUATERNION,
    *YOKE,
    *STICK_OVERRIDES,
    SURFACE_OVERRIDE,
    PAYLOAD,
    REVERSE_LEVER,
    LEVER,
    GENERATORS,
    VISUAL_OFFSET,
    *OTHER_PLACE,
    OTHER_OVERRIDE,
)
#: Weather before 12.08: names with brackets, knots; from then on elements by region, and the air at the aircraft.
OLD_WIND_SPEED = tuple(f"sim/weather/wind_speed_kt[{layer}]" for layer in range(3))
OLD_WIND_FROM = tuple(f"sim/weather/wind_direction_degt[{layer}]" for layer in range(3))
OLD_REAL_WEATHER = "sim/weather/use_real_weather_bool"
OLD_WIND_NOW = tuple(f"sim/weather/wind_now_{axis}_msc" for axis in "xyz")
REGION_SPEED = tuple(f"sim/weather/region/wind_speed_msc[{layer}]" for layer in range(13))
REGION_FROM = tuple(f"sim/weather/region/wind_direction_degt[{layer}]" for layer in range(13))
REGION_MODE = {
    "sim/weather/region/update_immediately": 1.0,
    "sim/weather/region/change_mode": 3.0,
    "sim/weather/region/variability_pct": 0.0,
}
REGION_WIND_NOW = tuple(f"sim/weather/aircraft/wind_now_{axis}_msc" for axis in "xyz")
#: First version with weather by region.
FIRST_WITH_REGIONS = 120800

#: Version 12's failure of the left aileron of the first set: hard over, trailing edge down.
AILERON_HARD_OVER = "sim/operation/failures/rel_fcon_ailn_1_lft_mxdn"

# --- commands ---
PAUSE_TOGGLE = "sim/operation/pause_toggle"
LOOK_DOWN = "sim/view/straight_down"
PANEL_VIEW = "sim/view/forward_with_2d_panel"
PLAIN_VIEW = "sim/view/forward_with_nothing"
HOLD_ALTITUDE = "sim/autopilot/altitude_hold"
#: Commands that lead back to a view, by `view_type`.
VIEWS = {
    1000: "sim/view/forward_with_2d_panel",
    1014: "sim/view/tower",
    1015: "sim/view/runway",
    1017: "sim/view/chase",
    1018: "sim/view/circle",
    1020: "sim/view/still_spot",
    1021: "sim/view/linear_spot",
    1023: "sim/view/forward_with_hud",
    1024: "sim/view/forward_with_nothing",
    1026: "sim/view/3d_cockpit_cmnd_look",
    1028: "sim/view/free_camera",
    1031: "sim/view/ridealong",
}
COMMANDS = (PAUSE_TOGGLE, LOOK_DOWN, PANEL_VIEW, PLAIN_VIEW, HOLD_ALTITUDE, *VIEWS.values())
