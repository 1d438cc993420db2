"""Position, attitude, motion, air data, forces, weather, weights and time."""

from __future__ import annotations

import math

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.frame import (
    BETA_SIGN,
    M_TO_FT,
    MPS_TO_FPM,
    MPS_TO_KT,
    PA_TO_INHG,
    PA_TO_PSF,
    SEA_LEVEL_DENSITY,
    Frame,
)

_POSITION = "sim/flightmodel/position/"
_FORCES = "sim/flightmodel/forces/"


def define(table: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    _position(table)
    _attitude_and_rates(table)
    _air_data(table, sim)
    _forces(table)
    _contact(table)
    _weather(table, sim)
    _weights(table)
    _time(table, sim)


def _position(t: Table) -> None:
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
    t.value(_POSITION + "hpath", lambda f: f.hpath)
    t.value(_POSITION + "vpath", lambda f: f.vpath)
    t.value("sim/flightmodel2/position/pressure_altitude", lambda f: f.m.pressure_altitude_m * M_TO_FT)
    t.setting("sim/physics/earth_radius_m", earth.EARTH_RADIUS_M)
    t.setting("sim/physics/g_sealevel", earth.GRAVITY_MPS2)
    t.value("_emulator/distance_m", lambda f: f.distance)


def _attitude_and_rates(t: Table) -> None:
    t.value(_POSITION + "theta", lambda f: f.theta)
    t.value(_POSITION + "phi", lambda f: f.phi)
    t.value(_POSITION + "psi", lambda f: f.psi)
    t.value(_POSITION + "true_theta", lambda f: f.true_theta)
    t.value(_POSITION + "true_phi", lambda f: f.true_phi)
    t.value(_POSITION + "true_psi", lambda f: f.true_psi)
    t.value(_POSITION + "mag_psi", lambda f: f.mag_psi)
    t.value(_POSITION + "magpsi", lambda f: f.mag_psi)
    t.value(_POSITION + "magnetic_variation", lambda f: -f.declination)
    t.array(_POSITION + "q", lambda f: f.q)
    for axis, rate, acceleration in (
        ("P", lambda f: f.m.p_rad_s, lambda f: f.m.p_dot_rad_s2),
        ("Q", lambda f: f.m.q_rad_s, lambda f: f.m.q_dot_rad_s2),
        ("R", lambda f: f.m.r_rad_s, lambda f: f.m.r_dot_rad_s2),
    ):
        t.value(_POSITION + axis, lambda f, rate=rate: math.degrees(rate(f)))
        t.value(_POSITION + axis + "rad", rate)
        t.value(_POSITION + axis + "_dot", lambda f, source=acceleration: math.degrees(source(f)))


def _air_data(t: Table, sim: Sources) -> None:
    t.value(_POSITION + "alpha", lambda f: math.degrees(f.m.alpha_rad))
    t.value(_POSITION + "beta", lambda f: BETA_SIGN * math.degrees(f.m.beta_rad))
    t.value(_POSITION + "true_airspeed", lambda f: f.m.true_airspeed_mps)
    t.value(_POSITION + "indicated_airspeed", lambda _: sim.instruments.airspeed_kt)
    t.value(_POSITION + "indicated_airspeed2", lambda _: sim.instruments.airspeed_kt)
    t.value(_POSITION + "equivalent_airspeed", lambda f: f.m.equivalent_airspeed_mps * MPS_TO_KT)
    t.value("_emulator/keas", lambda f: f.m.equivalent_airspeed_mps * MPS_TO_KT)
    t.value("_emulator/kcas", lambda f: f.m.calibrated_airspeed_mps * MPS_TO_KT)
    t.value("sim/flightmodel/misc/machno", lambda f: f.m.mach)
    t.value("sim/flightmodel/misc/Qstatic", lambda f: f.m.dynamic_pressure_pa * PA_TO_PSF)
    t.value("sim/flightmodel/misc/slip", lambda f: _slip_deg(f))
    t.value("sim/flightmodel/misc/h_ind", lambda _: sim.instruments.altitude_ft)
    gauges = "sim/cockpit2/gauges/indicators/"
    t.value(gauges + "altitude_ft_pilot", lambda _: sim.instruments.altitude_ft)
    t.value(gauges + "altitude_ft_copilot", lambda _: sim.instruments.altitude_ft)
    t.value(gauges + "airspeed_kts_pilot", lambda _: sim.instruments.airspeed_kt)
    t.value(gauges + "airspeed_kts_copilot", lambda _: sim.instruments.airspeed_kt)
    t.value(gauges + "calibrated_airspeed_kts_pilot", lambda f: f.m.calibrated_airspeed_mps * MPS_TO_KT)
    t.value(gauges + "true_airspeed_kts_pilot", lambda f: f.m.true_airspeed_mps * MPS_TO_KT)
    t.value(gauges + "mach_pilot", lambda f: f.m.mach)
    t.value(gauges + "vvi_fpm_pilot", lambda _: sim.instruments.vertical_speed_fpm)
    t.value(gauges + "vvi_fpm_copilot", lambda _: sim.instruments.vertical_speed_fpm)
    t.value(gauges + "pitch_vacuum_deg_pilot", lambda _: sim.instruments.pitch_deg)
    t.value(gauges + "roll_vacuum_deg_pilot", lambda _: sim.instruments.roll_deg)
    t.value(gauges + "pitch_electric_deg_pilot", lambda f: f.true_theta)
    t.value(gauges + "roll_electric_deg_pilot", lambda f: f.true_phi)
    t.value(gauges + "pitch_AHARS_deg_pilot", lambda f: f.true_theta)
    t.value(gauges + "roll_AHARS_deg_pilot", lambda f: f.true_phi)
    t.value(gauges + "heading_vacuum_deg_mag_pilot", lambda f: f.mag_psi)
    t.value(gauges + "heading_AHARS_deg_mag_pilot", lambda f: f.mag_psi)
    t.value(gauges + "compass_heading_deg_mag", lambda f: f.mag_psi)
    t.value(gauges + "slip_deg", lambda f: _slip_deg(f))
    t.value(gauges + "sideslip_degrees", lambda f: BETA_SIGN * math.degrees(f.m.beta_rad))
    t.value(gauges + "radio_altimeter_height_ft_pilot", lambda f: min(f.height * M_TO_FT, 2500.0))
    t.value(gauges + "ground_track_mag_pilot", lambda f: earth.wrap_degrees(f.hpath - f.declination))
    t.setting("sim/cockpit2/gauges/actuators/barometer_setting_in_hg_pilot", 29.92)
    t.setting("sim/cockpit2/gauges/actuators/barometer_setting_in_hg_copilot", 29.92)


def _slip_deg(f: Frame) -> float:
    """The ball: where the side force pushes it, right +."""
    return -math.degrees(math.atan2(f.m.specific_force_y_mps2, max(-f.m.specific_force_z_mps2, 1.0)))


def _forces(t: Table) -> None:
    g0 = earth.GRAVITY_MPS2
    t.value(_FORCES + "g_nrml", lambda f: -f.m.specific_force_z_mps2 / g0)
    t.value(_FORCES + "g_axil", lambda f: -f.m.specific_force_x_mps2 / g0)
    t.value(_FORCES + "g_side", lambda f: f.m.specific_force_y_mps2 / g0)
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


def _weather(t: Table, sim: Sources) -> None:
    # wind_speed_kt is in m/s in spite of its name
    t.value("_emulator/wind_speed_mps", lambda f: f.wind_speed)
    t.value("_emulator/wind_from_deg", lambda f: f.wind_from)
    t.value("_emulator/turbulence", lambda _: sim.weather.turbulence_mps / 10.0)
    t.value("sim/weather/wind_now_x_msc", lambda f: f.wind[0])
    t.value("sim/weather/wind_now_y_msc", lambda f: f.wind[1])
    t.value("sim/weather/wind_now_z_msc", lambda f: f.wind[2])
    t.value("sim/weather/wind_direction_degt", lambda f: f.wind_from)
    t.value("sim/weather/wind_speed_kt", lambda f: f.wind_speed)
    for axis in range(3):
        name = f"sim/weather/aircraft/wind_now_{'xyz'[axis]}_msc"
        t.value(name, lambda f, axis=axis: f.wind[axis])
    t.value("sim/weather/aircraft/wind_now_speed_msc", lambda f: f.wind_speed)
    t.value("sim/weather/aircraft/wind_now_direction_degt", lambda f: f.wind_from)
    # the old names for the air and the wind stayed in 12, beside the new ones
    t.value("sim/weather/rho", lambda f: f.m.air_density_kg_m3)
    t.value("sim/weather/sigma", lambda f: f.m.air_density_kg_m3 / SEA_LEVEL_DENSITY)
    t.value("sim/weather/temperature_ambient_c", lambda f: f.m.temperature_k - 273.15)
    t.value("sim/weather/temperature_le_c", lambda f: _total_temperature_c(f))
    t.value("sim/weather/barometer_current_inhg", lambda f: f.m.pressure_pa * PA_TO_INHG)
    t.value("sim/weather/speed_sound_ms", lambda f: f.m.speed_of_sound_mps)
    t.value("sim/weather/aircraft/temperature_ambient_deg_c", lambda f: f.m.temperature_k - 273.15)
    t.value("sim/weather/aircraft/temperature_leadingedge_deg_c", lambda f: _total_temperature_c(f))
    t.value("sim/weather/aircraft/barometer_current_pas", lambda f: f.m.pressure_pa)
    t.value("sim/weather/aircraft/speed_sound_ms", lambda f: f.m.speed_of_sound_mps)
    t.value("_emulator/density_ratio", lambda f: f.m.air_density_kg_m3 / SEA_LEVEL_DENSITY)
    t.value("_emulator/temperature_le_c", lambda f: _total_temperature_c(f))
    t.setting("sim/weather/barometer_sealevel_inhg", 29.92)
    t.setting("sim/weather/temperature_sealevel_c", 15.0)
    # what clients set; layer 0 blows at every height here (the brackets are part of the old names)
    t.setting("sim/weather/use_real_weather_bool")
    for layer in range(3):
        t.setting(f"sim/weather/wind_altitude_msl_m[{layer}]")
        t.setting(f"sim/weather/wind_direction_degt[{layer}]")
        t.setting(f"sim/weather/wind_speed_kt[{layer}]")
        t.setting(f"sim/weather/shear_speed_kt[{layer}]")
        t.setting(f"sim/weather/shear_direction_degt[{layer}]")
        t.setting(f"sim/weather/turbulence[{layer}]")
    t.setting("sim/weather/wind_turbulence_percent")
    region = "sim/weather/region/"
    t.setting(region + "update_immediately")
    t.setting(region + "change_mode", 3)
    t.setting(region + "variability_pct")
    for name in ("wind_altitude_msl_m", "wind_direction_degt", "wind_speed_msc", "shear_speed_msc", "turbulence"):
        t.setting(region + name)
    t.setting(region + "sealevel_pressure_pas", 101325.0)
    t.setting(region + "sealevel_temperature_c", 15.0)


def _total_temperature_c(f: Frame) -> float:
    return f.m.temperature_k * (1.0 + 0.2 * f.m.mach**2) - 273.15


def _weights(t: Table) -> None:
    weight = "sim/flightmodel/weight/"
    t.array(weight + "m_fuel", lambda f: f.m.fuel_kg)
    t.array("_emulator/fuel_kg", lambda f: f.m.fuel_kg, size=9)
    t.value(weight + "m_fuel_total", lambda f: sum(f.m.fuel_kg))
    t.value(weight + "m_fixed", lambda f: f.m.payload_kg)
    t.value(weight + "m_total", lambda f: f.m.mass_kg)
    t.setting(weight + "m_jettison")
    t.value("sim/aircraft/weight/acf_m_empty", lambda f: f.m.empty_mass_kg)
    t.value(
        "sim/aircraft/weight/acf_m_max", lambda f: 1.15 * f.m.mass_kg if f.m.empty_mass_kg == 0 else _maximum_mass(f)
    )
    # the list of 12.08 marks the old name as replaced
    t.value("sim/flightmodel/misc/cgz_ref_to_default", lambda f: -f.m.cg_forward_m)
    t.value("sim/flightmodel2/misc/cg_offset_z", lambda f: -f.m.cg_forward_m)


def _maximum_mass(f: Frame) -> float:
    return round(1.5 * f.m.empty_mass_kg, -1)


def _time(t: Table, sim: Sources) -> None:
    clock = sim.clocks
    t.value("sim/time/total_running_time_sec", lambda _: clock.running, always=True)
    t.value("sim/time/total_flight_time_sec", lambda _: clock.flight)
    t.value("sim/time/timer_elapsed_time_sec", lambda _: clock.flight)
    t.value("sim/time/zulu_time_sec", lambda _: clock.zulu)
    t.value("sim/time/local_time_sec", lambda f: _local_time(clock.zulu, f.m.longitude_deg))
    t.value("sim/time/local_date_days", lambda _: clock.date_days)
    t.value("sim/time/hobbs_time", lambda _: clock.flight / 3600.0)
    t.value("sim/time/paused", lambda _: clock.paused, always=True)
    t.setting("sim/time/is_in_replay")
    t.setting("sim/time/sim_speed", 1)
    t.setting("sim/time/ground_speed", 1)
    t.value("sim/time/sim_speed_actual", lambda _: clock.simulated_period / max(clock.wall_period, 1e-6))
    t.value("sim/time/framerate_period", lambda _: clock.simulated_period, always=True)
    t.value("sim/operation/misc/frame_rate_period", lambda _: clock.simulated_period, always=True)
    t.value("sim/network/misc/network_time_sec", lambda _: clock.running, always=True)
    t.value("_emulator/frame_rate", lambda _: 1.0 / max(clock.wall_period, 1e-6), always=True)
    t.value("_emulator/simulated_rate", lambda _: 1.0 / max(clock.simulated_period, 1e-6), always=True)
    t.value("_emulator/cpu_time", lambda _: clock.work, always=True)
    t.value("_emulator/zulu_hours", lambda _: clock.zulu / 3600.0)
    t.value("_emulator/local_hours", lambda f: _local_time(clock.zulu, f.m.longitude_deg) / 3600.0)


def _local_time(zulu: float, longitude_deg: float) -> float:
    """Zone time: whole hours by longitude."""
    return (zulu + 3600.0 * round(longitude_deg / 15.0)) % 86400.0
