"""Fields that messages have got since version 0.1.0, for bags that were recorded before.

Made from migration/ and msg/ by cmake/message_code (`python3 cmake/message_code migration`); not to be edited.
"""

from __future__ import annotations

from typing import Dict, Tuple

#: (type, elements; 0: a scalar, -1: a list; unit) by field, by message.
LATER_FIELDS: Dict[str, Dict[str, Tuple[str, int, str]]] = {
    "xplane_bridge/AutopilotState": {
        "target_mach": ("float32", 0, "-"),
        "airspeed_is_mach": ("float32", 0, "0, 1"),
        "heading_status": ("float32", 0, "-"),
        "vertical_speed_status": ("float32", 0, "-"),
        "speed_status": ("float32", 0, "-"),
        "pitch_status": ("float32", 0, "-"),
        "roll_status": ("float32", 0, "-"),
    },
    "xplane_bridge/ElectricalState": {
        "pitot_heat_copilot_on": ("float32", 0, "0, 1"),
        "static_heat_on": ("float32", 2, "0, 1"),
        "aoa_heat_on": ("float32", 2, "0, 1"),
        "window_heat_on": ("float32", 0, "0, 1"),
        "wing_heat_on": ("float32", 2, "0, 1"),
        "wing_boots_on": ("float32", 2, "-"),
        "wing_bleed_air_on": ("float32", 2, "0, 1"),
        "wing_fluid_on": ("float32", 2, "-"),
        "ice_detector_on": ("float32", 0, "0, 1"),
        "deicing_fluid": ("float32", 0, "m^3"),
        "cabin_altitude": ("float32", 0, "m"),
        "cabin_vertical_speed": ("float32", 0, "m/s"),
        "cabin_pressure_difference": ("float32", 0, "Pa"),
        "cabin_altitude_set": ("float32", 0, "m"),
        "cabin_vertical_speed_set": ("float32", 0, "m/s"),
        "cabin_dump_on": ("float32", 0, "0, 1"),
        "bleed_air_mode": ("float32", 0, "-"),
        "oxygen_on": ("float32", 0, "0, 1"),
        "oxygen_pressure": ("float32", 0, "Pa"),
        "oxygen_volume": ("float32", 0, "m^3"),
        "oxygen_felt_altitude": ("float32", 0, "m"),
    },
    "xplane_bridge/EngineStates": {
        "magnetos": ("float32", 8, "-"),
        "igniter_on": ("float32", 8, "0, 1"),
        "starter_running": ("float32", 8, "0, 1"),
        "fuel_pump_on": ("float32", 8, "0, 1"),
        "carburettor_heat": ("float32", 8, "0..1"),
        "cowl_flap": ("float32", 8, "0..1"),
        "inlet_heat_on": ("float32", 8, "0, 1"),
        "propeller_heat_on": ("float32", 8, "0, 1"),
        "gauge_in_celsius": ("float32", 4, "0, 1"),
    },
    "xplane_bridge/FrameState": {
        "camera_pose_source": ("uint8", 0, "-"),
        "body_to_camera.translation.x": ("float64", 0, "-"),
        "body_to_camera.translation.y": ("float64", 0, "-"),
        "body_to_camera.translation.z": ("float64", 0, "-"),
        "body_to_camera.rotation.x": ("float64", 0, "-"),
        "body_to_camera.rotation.y": ("float64", 0, "-"),
        "body_to_camera.rotation.z": ("float64", 0, "-"),
        "body_to_camera.rotation.w": ("float64", 0, "-"),
        "camera_pose_uncertainty_deg": ("float32", 0, "deg"),
        "camera_pose_uncertainty": ("float32", 0, "m"),
        "picture_x": ("uint32", 0, "px"),
        "picture_y": ("uint32", 0, "px"),
        "picture_width": ("uint32", 0, "px"),
        "picture_height": ("uint32", 0, "px"),
    },
    "xplane_bridge/FuelState": {
        "fuel_selector": ("float32", 0, "-"),
        "fuel_selector_left": ("float32", 0, "-"),
        "fuel_selector_right": ("float32", 0, "-"),
        "fuel_transfer_from": ("float32", 0, "-"),
        "fuel_transfer_to": ("float32", 0, "-"),
        "tank_pump_on": ("float32", 9, "0, 1"),
    },
    "xplane_bridge/SimStatus": {
        "frames_missed": ("uint32", 0, "-"),
    },
    "xplane_bridge/SurfaceStates": {
        "wing_elevator1": ("float32", 8, "deg"),
        "wing_elevator2": ("float32", 8, "deg"),
    },
}
