"""Air and weather: what blows at the aircraft, and what clients set."""

from __future__ import annotations

from functools import partial

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.datarefs.world_settings import FULL_TURBULENCE_MPS
from xplane_bridge.emulator.flight.frame import PA_TO_INHG, SEA_LEVEL_DENSITY, Frame

METERS_PER_MILE = 1609.344
#: Sight until a client sets another [m].
VISIBILITY_M = 40000.0


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    # wind_speed_kt is in m/s in spite of its name
    t.value("_emulator/wind_speed_mps", lambda f: f.wind_speed)
    t.value("_emulator/wind_from_deg", lambda f: f.wind_from)
    t.value("_emulator/turbulence", lambda _: min(sim.settings.weather.turbulence_mps / FULL_TURBULENCE_MPS, 1.0))
    t.value("sim/weather/wind_direction_degt", lambda f: f.wind_from)
    t.value("sim/weather/wind_speed_kt", lambda f: f.wind_speed)
    goes = -1.0 if "wind-direction" in sim.otherwise else 1.0
    for folder in ("sim/weather/", "sim/weather/aircraft/"):
        for axis in range(3):
            t.value(f"{folder}wind_now_{'xyz'[axis]}_msc", partial(lambda axis, f: goes * f.wind[axis], axis))
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
    _sky(t)


def _sky(t: Table) -> None:
    """Clouds, sight and rain as they were set; the view does not show them."""
    t.setting("sim/weather/visibility_reported_m", VISIBILITY_M)
    t.setting("sim/weather/region/visibility_reported_sm", VISIBILITY_M / METERS_PER_MILE)
    t.alias("sim/weather/aircraft/visibility_reported_sm", "sim/weather/region/visibility_reported_sm")
    for rain in ("sim/weather/rain_percent", "sim/weather/region/rain_percent"):
        t.setting(rain)
    for name in ("cloud_base_msl_m", "cloud_tops_msl_m", "cloud_type"):
        for layer in range(3):
            t.setting(f"sim/weather/{name}[{layer}]")
        t.setting(f"sim/weather/region/{name}")
        t.alias(f"sim/weather/aircraft/{name}", f"sim/weather/region/{name}")
    for layer in range(3):
        t.setting(f"sim/weather/cloud_coverage[{layer}]")
    t.setting("sim/weather/region/cloud_coverage_percent")
    t.alias("sim/weather/aircraft/cloud_coverage_percent", "sim/weather/region/cloud_coverage_percent")
    t.alias("sim/weather/precipitation_on_aircraft_ratio", "sim/weather/rain_percent")
    t.alias("sim/weather/aircraft/precipitation_on_aircraft_ratio", "sim/weather/region/rain_percent")


def _total_temperature_c(f: Frame) -> float:
    return f.m.temperature_k * (1.0 + 0.2 * f.m.mach**2) - 273.15
