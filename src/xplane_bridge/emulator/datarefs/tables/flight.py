"""Position, attitude, motion, air data, forces, weights and time."""

from __future__ import annotations

import math
from typing import Callable

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.datarefs.tables.instruments import slip_deg
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.frame import (
    BETA_SIGN,
    M_TO_FT,
    MPS_TO_FPM,
    MPS_TO_KT,
    PA_TO_PSF,
    Frame,
)
from xplane_bridge.units import EARTH_RADIUS_M, GRAVITY_MPS2

_POSITION = "sim/flightmodel/position/"
_FORCES = "sim/flightmodel/forces/"


def define(table: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    _position(table, sim)
    _attitude_and_rates(table, sim)
    _air_data(table, sim)
    _forces(table, sim)
    _contact(table)
    _weights(table, sim)
    _time(table, sim)


def _position(t: Table, sim: Sources) -> None:
    t.value(_POSITION + "latitude", lambda f: f.m.latitude_deg)
    t.value(_POSITION + "longitude", lambda f: f.m.longitude_deg)
    t.value(_POSITION + "elevation", lambda f: f.m.altitude_m)
    t.value(_POSITION + "local_x", lambda f: f.position[0])
    t.value(_POSITION + "local_y", lambda f: f.position[1])
    t.value(_POSITION + "local_z", lambda f: f.position[2])
    t.value(_POSITION + "lat_ref", lambda f: f.local.lat_ref)
    t.value(_POSITION + "lon_ref", lambda f: f.local.lon_ref)
    t.value(_POSITION + "y_agl", lambda f: f.height)
    t.value(_POSITION + "local_vx", lambda f: f.velocity[0])
    t.value(_POSITION + "local_vy", lambda f: f.velocity[1])
    t.value(_POSITION + "local_vz", lambda f: f.velocity[2])
    t.value(_POSITION + "local_ax", lambda f: f.acceleration[0])
    t.value(_POSITION + "local_ay", lambda f: f.acceleration[1])
    t.value(_POSITION + "local_az", lambda f: f.acceleration[2])
    t.value(_POSITION + "groundspeed", lambda f: f.ground_speed)
    t.value(_POSITION + "vh_ind", lambda f: -f.m.v_down_mps)
    t.value(_POSITION + "vh_ind_fpm", lambda f: -f.m.v_down_mps * MPS_TO_FPM)
    t.value(_POSITION + "vh_ind_fpm2", lambda f: -f.m.v_down_mps * MPS_TO_FPM)
    t.value(_POSITION + "hpath", _air_path if "hpath" in sim.otherwise else lambda f: f.hpath)
    t.value(_POSITION + "vpath", lambda f: f.vpath)
    t.value("sim/flightmodel2/position/pressure_altitude", lambda f: f.m.pressure_altitude_m * M_TO_FT)
    t.setting("sim/physics/earth_radius_m", EARTH_RADIUS_M)
    t.setting("sim/physics/g_sealevel", GRAVITY_MPS2)
    t.value("_emulator/distance_m", lambda f: f.distance)
    t.value("_emulator/terrain_ft", lambda f: f.m.terrain_elevation_m * M_TO_FT)
    t.value("_emulator/corner_latitude", lambda f: math.floor(f.m.latitude_deg))
    t.value("_emulator/corner_longitude", lambda f: math.floor(f.m.longitude_deg))


def _air_path(f: Frame) -> float:
    """Direction of the path through the air."""
    north, east = f.m.v_north_mps - f.m.wind_north_mps, f.m.v_east_mps - f.m.wind_east_mps
    return earth.wrap_degrees(math.degrees(math.atan2(east, north)))


def _attitude_and_rates(t: Table, sim: Sources) -> None:
    t.value(_POSITION + "theta", lambda f: f.theta)
    t.value(_POSITION + "phi", lambda f: f.phi)
    t.value(_POSITION + "psi", lambda f: f.psi)
    t.value(_POSITION + "true_theta", lambda f: f.true_theta)
    t.value(_POSITION + "true_phi", lambda f: f.true_phi)
    t.value(_POSITION + "true_psi", lambda f: f.true_psi)
    t.value(_POSITION + "mag_psi", lambda f: f.mag_psi)
    t.value(_POSITION + "magpsi", lambda f: f.mag_psi)
    west = -1.0 if "declination-sign" not in sim.otherwise else 1.0
    t.value(_POSITION + "magnetic_variation", lambda f: west * f.declination)
    t.array(_POSITION + "q", lambda f: f.q)
    for axis, rate, acceleration in (
        ("P", lambda f: f.m.p_rad_s, lambda f: f.m.p_dot_rad_s2),
        ("Q", lambda f: f.m.q_rad_s, lambda f: f.m.q_dot_rad_s2),
        ("R", lambda f: f.m.r_rad_s, lambda f: f.m.r_dot_rad_s2),
    ):
        t.value(_POSITION + axis, _in_degrees(rate))
        t.value(_POSITION + axis + "rad", rate)
        t.value(_POSITION + axis + "_dot", _in_degrees(acceleration))


def _in_degrees(source: Callable[[Frame], float]) -> Callable[[Frame], float]:
    return lambda f: math.degrees(source(f))


def _air_data(t: Table, sim: Sources) -> None:
    t.value(_POSITION + "alpha", lambda f: math.degrees(f.m.alpha_rad))
    beta_sign = -BETA_SIGN if "beta-sign" in sim.otherwise else BETA_SIGN
    t.value(_POSITION + "beta", lambda f: beta_sign * math.degrees(f.m.beta_rad))
    t.value(_POSITION + "true_airspeed", lambda f: f.m.true_airspeed_mps)
    t.value(_POSITION + "indicated_airspeed", lambda _: sim.instruments.airspeed_kt)
    t.value(_POSITION + "indicated_airspeed2", lambda _: sim.copilot_instruments.airspeed_kt)
    t.value(_POSITION + "equivalent_airspeed", lambda f: f.m.equivalent_airspeed_mps * MPS_TO_KT)
    t.value("_emulator/keas", lambda f: f.m.equivalent_airspeed_mps * MPS_TO_KT)
    t.value("_emulator/kcas", lambda f: f.m.calibrated_airspeed_mps * MPS_TO_KT)
    t.value("sim/flightmodel/misc/machno", lambda f: f.m.mach)
    t.value("sim/flightmodel/misc/Qstatic", lambda f: f.m.dynamic_pressure_pa * PA_TO_PSF)
    t.value("sim/flightmodel/misc/slip", slip_deg)
    t.value("sim/flightmodel/misc/h_ind", lambda _: sim.instruments.altitude_ft)


def _forces(t: Table, sim: Sources) -> None:
    g0 = GRAVITY_MPS2
    axial = 1.0 if "axial-sign" in sim.otherwise else -1.0
    side = -1.0 if "side-sign" in sim.otherwise else 1.0
    t.value(_FORCES + "g_nrml", lambda f: -f.m.specific_force_z_mps2 / g0)
    t.value(_FORCES + "g_axil", lambda f: axial * f.m.specific_force_x_mps2 / g0)
    t.value(_FORCES + "g_side", lambda f: side * f.m.specific_force_y_mps2 / g0)
    t.alias("sim/flightmodel2/misc/gforce_normal", _FORCES + "g_nrml")
    t.alias("sim/flightmodel2/misc/gforce_axil", _FORCES + "g_axil")
    t.alias("sim/flightmodel2/misc/gforce_side", _FORCES + "g_side")
    t.value(_FORCES + "L_aero", lambda f: f.m.aero_roll_nm)
    t.value(_FORCES + "M_aero", lambda f: f.m.aero_pitch_nm)
    t.value(_FORCES + "N_aero", lambda f: f.m.aero_yaw_nm)
    t.value(_FORCES + "L_total", lambda f: f.m.aero_roll_nm)
    t.value(_FORCES + "M_total", lambda f: f.m.aero_pitch_nm)
    t.value(_FORCES + "N_total", lambda f: f.m.aero_yaw_nm)
    t.value(_FORCES + "lift_path_axis", lambda f: f.m.lift_n)
    t.value(_FORCES + "drag_path_axis", lambda f: f.m.drag_n)
    t.value(_FORCES + "side_path_axis", lambda f: f.m.side_force_n)
    t.value(_FORCES + "fnrml_aero", lambda f: f.m.lift_n)
    t.value(_FORCES + "faxil_aero", lambda f: f.m.drag_n)
    t.value(_FORCES + "fside_aero", lambda f: f.m.side_force_n)
    t.value(_FORCES + "fnrml_gear", lambda f: sum(wheel.vertical_force_n for wheel in f.m.gear))


def _contact(t: Table) -> None:
    t.value("sim/flightmodel/failures/onground_any", lambda f: f.m.on_ground_any)
    t.value("sim/flightmodel/failures/onground_all", lambda f: f.m.on_ground_all)
    t.value("sim/flightmodel2/misc/has_crashed", lambda f: f.m.crashed)
    t.value("sim/flightmodel/failures/stallwarning", lambda f: f.m.stall_warning)
    t.value(
        "sim/flightmodel/failures/over_vne",
        lambda f: f.info.never_exceed_mps > 0.0 and f.m.calibrated_airspeed_mps > f.info.never_exceed_mps,
    )
    gear = "sim/flightmodel2/gear/"
    t.array(gear + "deploy_ratio", lambda f: [wheel.extended for wheel in f.m.gear])
    t.alias("sim/aircraft/parts/acf_gear_deploy", gear + "deploy_ratio")
    t.array(gear + "tire_steer_actual_deg", lambda f: [wheel.steer_deg for wheel in f.m.gear])
    t.array(gear + "tire_steer_command_deg", lambda f: [wheel.steer_deg for wheel in f.m.gear])
    t.array(gear + "on_ground", lambda f: [wheel.on_ground for wheel in f.m.gear])
    t.array(gear + "tire_vertical_deflection_mtr", lambda f: [wheel.compression_m for wheel in f.m.gear])
    t.array("_emulator/gear_force_n", lambda f: [wheel.vertical_force_n for wheel in f.m.gear], size=10)


def _weights(t: Table, sim: Sources) -> None:
    weight = "sim/flightmodel/weight/"
    t.array(weight + "m_fuel", lambda f: f.m.fuel_kg)
    t.array("_emulator/fuel_kg", lambda f: f.m.fuel_kg, size=9)
    t.value(weight + "m_fuel_total", lambda f: sum(f.m.fuel_kg))
    t.value(weight + "m_fixed", lambda f: f.m.payload_kg)
    t.array(weight + "m_stations", lambda _: sim.settings.shown_stations_kg())
    t.value(weight + "m_total", lambda f: f.m.mass_kg)
    t.setting(weight + "m_jettison")
    per_kg = 1.0 / 0.45359237 if "mass-unit" in sim.otherwise else 1.0
    t.value("sim/aircraft/weight/acf_m_empty", lambda f: per_kg * f.m.empty_mass_kg)
    t.value("sim/aircraft/weight/acf_m_max", lambda f: per_kg * f.info.maximum_mass_kg)
    # the list of 12.08 marks the old name as replaced
    # without fuel, whose tanks are at the reference point
    t.value("sim/flightmodel/misc/cgz_ref_to_default", lambda f: -f.m.cg_forward_m * f.m.mass_kg / f.m.dry_mass_kg)
    t.value("sim/flightmodel2/misc/cg_offset_z", lambda f: -f.m.cg_forward_m)


def _time(t: Table, sim: Sources) -> None:
    clock = sim.clocks
    t.value("sim/time/total_running_time_sec", lambda _: clock.running, always=True)
    t.value("sim/time/total_flight_time_sec", lambda _: clock.flight)
    t.value("sim/time/timer_elapsed_time_sec", lambda _: clock.flight)
    t.value("sim/time/zulu_time_sec", lambda _: clock.zulu)
    t.value("sim/time/local_time_sec", lambda f: clock.local(f.m.longitude_deg))
    t.value("sim/time/local_date_days", lambda _: clock.date_days)
    t.value("sim/time/hobbs_time", lambda _: clock.flight)
    t.value("sim/time/paused", lambda _: clock.paused, always=True)
    t.setting("sim/time/is_in_replay")
    t.setting("sim/time/use_system_time")
    t.setting("sim/time/sim_speed", 1)
    t.setting("sim/time/ground_speed", 1)
    t.value(
        "sim/time/sim_speed_actual",
        lambda _: clock.time_ratio * clock.simulated_period / max(clock.wall_period, 1e-6),
    )
    t.value("sim/time/framerate_period", lambda _: clock.simulated_period, always=True)
    t.value("sim/operation/misc/frame_rate_period", lambda _: clock.simulated_period, always=True)
    t.value("sim/network/misc/network_time_sec", lambda _: clock.running, always=True)
    t.value("_emulator/frame_rate", lambda _: 1.0 / max(clock.wall_period, 1e-6), always=True)
    t.value("_emulator/simulated_rate", lambda _: 1.0 / max(clock.simulated_period, 1e-6), always=True)
    t.value("_emulator/cpu_time", lambda _: clock.work, always=True)
    t.value("_emulator/zulu_hours", lambda _: clock.zulu / 3600.0)
    t.value("_emulator/local_hours", lambda f: clock.local(f.m.longitude_deg) / 3600.0)
