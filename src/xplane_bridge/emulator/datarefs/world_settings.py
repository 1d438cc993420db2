"""The day, the air and the loading as clients write them, on their way to the aircraft."""

from __future__ import annotations

import math
from functools import partial
from typing import Callable, FrozenSet, Sequence

from xplane_bridge.emulator.datarefs.aircraft_systems import INHG_PA, Weather
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight.flight_model import FlightModel, FlightModelError
from xplane_bridge.emulator.flight.frame import Clocks
from xplane_bridge.units import KNOT_MPS

#: Vertical gust per unit of X-Plane's turbulence, which goes from 0 to 10 [m/s].
TURBULENCE_MPS_PER_UNIT = 0.5
FULL_TURBULENCE_MPS = 10.0 * TURBULENCE_MPS_PER_UNIT
#: What clients may make of the air and the loading; values beyond are cut to these.
_TEMPERATURE_C = (-45.0, 75.0)
PRESSURE_INHG = (25.5, 32.0)
_MAX_WIND_MPS = 100.0
_MAX_TURBULENCE_MPS = 10.0
_MAX_LOAD_KG = 5000.0
_STATIONS = 9
_SEA_LEVEL = "sim/weather/barometer_sealevel_inhg"
_SEA_LEVEL_TEMPERATURE = "sim/weather/temperature_sealevel_c"
#: 12 has the sea level's air by two names, one of them in another unit: times so much.
_TWICE_NAMED = (
    (_SEA_LEVEL, "sim/weather/region/sealevel_pressure_pas", INHG_PA),
    (_SEA_LEVEL_TEMPERATURE, "sim/weather/region/sealevel_temperature_c", 1.0),
)
#: Where the centre of gravity is set: by the first of these that the version has.
#: Of the centre of gravity, aft: without fuel; with it.
DRY_CG, LOADED_CG = "sim/flightmodel/misc/cgz_ref_to_default", "sim/flightmodel2/misc/cg_offset_z"


class WorldSettings:
    """Datarefs of weather, time and loading that reach the flight model when they are written.

    Args:
        store: Of the datarefs.
        clocks: Are set by the time's.
        model: Gives the aircraft of now.
        otherwise: Of `otherwise.IDS`.

    Attributes:
        weather: The present one.
        stations_kg: The payload by station, as a client has set it last.
    """

    def __init__(
        self, store: DatarefStore, clocks: Clocks, model: Callable[[], FlightModel], otherwise: FrozenSet[str]
    ) -> None:
        self._store, self._model, self._otherwise = store, model, otherwise
        self.weather = Weather()
        self.stations_kg = [0.0] * _STATIONS
        self._connect(clocks)

    def _connect(self, clocks: Clocks) -> None:
        store = self._store

        def set_clock(attribute: str) -> Callable[[int, float], None]:
            return lambda _index, value: setattr(clocks, attribute, value)

        store.on_write("sim/time/total_flight_time_sec", set_clock("flight"))
        store.on_write("sim/time/zulu_time_sec", lambda _i, value: setattr(clocks, "zulu", value % 86400.0))
        store.on_write("sim/flightmodel/weight/m_fixed", self._set_payload)
        store.on_write("sim/flightmodel/weight/m_stations", self._set_station)
        store.on_write("sim/flightmodel/weight/m_fuel", self._set_fuel)
        store.on_write(DRY_CG, lambda _, value: self._model().set_loading(cg_aft_m=value))
        store.on_write(LOADED_CG, self._set_balance)
        store.on_write("sim/time/local_date_days", lambda _i, value: setattr(clocks, "date_days", int(value)))
        for name, region, factor in _TWICE_NAMED:
            store.on_write(name, partial(lambda to, k, _, value: self._set_atmosphere(to, value * k), region, factor))
            store.on_write(region, partial(lambda to, k, _, value: self._set_atmosphere(to, value / k), name, factor))
        if not store.dataref("sim/weather/region/wind_speed_msc").visible:
            layer = "sim/weather/{}[0]"
            names = (layer.format("wind_direction_degt"), layer.format("wind_speed_kt"), layer.format("turbulence"))
            factor = KNOT_MPS  # the layers' speed is in knots, unlike the present wind's
        else:
            region = "sim/weather/region/"
            names = (region + "wind_direction_degt", region + "wind_speed_msc", region + "turbulence")
            factor = KNOT_MPS if "wind-names" in self._otherwise else 1.0
        direction, speed, turbulence = names
        self._wind_settings = (*names, factor)

        def set_wind(_index: int, _value: float) -> None:
            self.weather.wind_from_deg = math.fmod(store.get(direction), 360.0)
            self.weather.wind_mps = clip(store.get(speed) * factor, 0.0, _MAX_WIND_MPS)
            self.weather.blow(self._model())

        store.on_write(direction, set_wind)
        store.on_write(speed, set_wind)

        def set_turbulence(_index: int, _value: float) -> None:
            gust = clip(store.get(turbulence) * TURBULENCE_MPS_PER_UNIT, 0.0, _MAX_TURBULENCE_MPS)
            self.weather.turbulence_mps = gust
            self._model().set_turbulence(gust)

        store.on_write(turbulence, set_turbulence)

    def shown_stations_kg(self) -> Sequence[float]:
        """The payload by station: as it was set, or where it was set by its sum, all on the first one."""
        payload_kg = self._model().state.payload_kg
        as_set = abs(sum(self.stations_kg) - payload_kg) < 0.01
        return self.stations_kg if as_set else [payload_kg] + [0.0] * (_STATIONS - 1)

    def set_weather(self, weather: Weather) -> None:
        """Takes wind and turbulence of the command line."""
        self.weather = weather
        weather.apply(self._model())
        # as clients read it, who put it back
        direction, speed, turbulence, factor = self._wind_settings
        self._store.set(direction, weather.wind_from_deg)
        self._store.set(speed, weather.wind_mps / factor)
        self._store.set(turbulence, weather.turbulence_mps / TURBULENCE_MPS_PER_UNIT)

    def show_air(self, offset_k: float, pressure_pa: float) -> None:
        """Shows the air that the aircraft was put into, of which clients may then change one number.

        Args:
            offset_k: Difference from the standard temperature.
            pressure_pa: At sea level.
        """
        self.weather.air = offset_k, pressure_pa
        for (name, region, factor), value in zip(_TWICE_NAMED, (pressure_pa, 15.0 + offset_k)):
            self._store.set(name, value / factor)
            self._store.set(region, value)

    def _set_fuel(self, tank: int, value: float) -> None:
        tanks = self._model().info.tank_count
        slots = self._store.dataref("sim/flightmodel/weight/m_fuel").slots
        self._store.values[slots[tanks:]] = 0.0  # no such tanks
        # The other tanks as they are, not as written: what was refused of one would have all others refused.
        fuel = [*self._model().state.fuel_kg, *[0.0] * tanks][:tanks]
        if tank < tanks:
            fuel[tank] = clip(value, 0.0, _MAX_LOAD_KG)
        self._model().set_loading(fuel_kg=fuel)

    def _set_payload(self, _index: int, value: float) -> None:
        if "stations" in self._otherwise:  # the payload is their sum, whatever is written
            return
        self._model().set_loading(payload_kg=clip(value, 0.0, _MAX_LOAD_KG))

    def _set_station(self, station: int, value: float) -> None:
        # The others as they are, not as written: what was refused of one would have all others refused.
        stations_kg = list(self.shown_stations_kg())
        stations_kg[station] = clip(value, 0.0, _MAX_LOAD_KG)
        self._model().set_loading(payload_kg=sum(stations_kg))
        self.stations_kg = stations_kg

    def _set_balance(self, _index: int, value: float) -> None:
        loaded = self._model().state
        if loaded.dry_mass_kg <= 0.0:
            raise FlightModelError(f"{LOADED_CG}: nothing is loaded before the first flight; set it later")
        self._model().set_loading(cg_aft_m=value * loaded.mass_kg / loaded.dry_mass_kg)

    def _set_atmosphere(self, other: str, value: float) -> None:
        """Takes what was written; `other` is its second name, with the value there."""
        self._store.set(other, value)
        self.weather.air = (
            clip(self._store.get(_SEA_LEVEL_TEMPERATURE), *_TEMPERATURE_C) - 15.0,
            clip(self._store.get(_SEA_LEVEL), *PRESSURE_INHG) * INHG_PA,
        )
        self._model().set_atmosphere(*self.weather.air)


def clip(value: float, low: float, high: float) -> float:
    """`value`, or the bound it is beyond."""
    return min(max(value, low), high)
