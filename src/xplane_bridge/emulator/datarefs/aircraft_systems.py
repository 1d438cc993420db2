"""The aircraft's systems that no flight model has: electrics, instruments and their failures, weather as set.

Simple, but of one piece: buses are fed by generators of running engines, else by batteries that are switched on; a
blocked pitot tube keeps the pressure it had; switches and failures act on what hangs on them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, List, Optional, Tuple

from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight.flight_model import FlightModel
from xplane_bridge.emulator.flight.frame import M_TO_FT as _M_TO_FT
from xplane_bridge.emulator.flight.frame import MPS_TO_FPM, MPS_TO_KT, Frame, indicated_altitude_m

_BATTERY_VOLTS = 24.0
_GENERATOR_VOLTS = 28.0
_BASE_LOAD_A = 6.0
#: Current of each switch when on [A].
_LOADS = {
    "sim/cockpit2/switches/avionics_power_on": 9.0,
    "sim/cockpit2/switches/navigation_lights_on": 5.0,
    "sim/cockpit2/switches/beacon_on": 4.0,
    "sim/cockpit2/switches/strobe_lights_on": 6.0,
    "sim/cockpit2/switches/landing_lights_on": 15.0,
    "sim/cockpit2/switches/taxi_light_on": 8.0,
    "sim/cockpit2/ice/ice_pitot_heat_on_pilot": 10.0,
}
_FULL_CHARGE_AH = 24.0
#: Failures that are measured or shown with this setting [Pa per inch of mercury].
INHG_PA = 3386.389

Failed = Callable[[str], bool]


@dataclass
class Electrics:
    """Two buses with a battery and one generator per engine; the elements X-Plane has beyond those stay 0."""

    bus_volts: List[float] = field(default_factory=lambda: [0.0] * 6)
    bus_amps: List[float] = field(default_factory=lambda: [0.0] * 6)
    battery_volts: List[float] = field(default_factory=lambda: [0.0] * 8)
    battery_amps: List[float] = field(default_factory=lambda: [0.0] * 8)
    generator_amps: List[float] = field(default_factory=lambda: [0.0] * 8)
    generator_off: List[bool] = field(default_factory=lambda: [False] * 8)
    charge_ah: float = _FULL_CHARGE_AH
    _switches: Optional[Callable[[], List[float]]] = None

    def update(self, dt: float, store: DatarefStore, frame: Frame, failed: Failed) -> None:
        """Takes a new frame."""
        if self._switches is None:
            self._switches = store.gather((*_LOADS, "sim/cockpit2/electrical/battery_on"))
        *switched, battery_on = self._switches()
        load = _BASE_LOAD_A + sum(amps for amps, on in zip(_LOADS.values(), switched) if on != 0.0)
        switches = store.array("sim/cockpit2/electrical/generator_on")
        working = []
        for i, engine in enumerate(frame.m.engines[:8]):
            good = engine.running and switches[i] != 0.0 and not failed(f"rel_genera{i}")
            self.generator_off[i] = not good
            if good:
                working.append(i)
        battery = battery_on != 0.0 and not failed("rel_batter0")
        self.generator_amps = [0.0] * 8
        for i in working:
            self.generator_amps[i] = load / len(working)
        charge = self.charge_ah / _FULL_CHARGE_AH
        volts = _BATTERY_VOLTS * (0.85 + 0.15 * charge) if self.charge_ah > 0.0 else 0.0
        supply = _GENERATOR_VOLTS if working else volts if battery else 0.0
        current = 0.0  # into the battery
        if battery:
            current = 5.0 * (1.0 - charge) if working else -load
        self.charge_ah = min(max(self.charge_ah + current * dt / 3600.0, 0.0), _FULL_CHARGE_AH)
        self.battery_volts[0] = 0.0 if failed("rel_batter0") else max(volts, supply if battery else 0.0)
        self.battery_amps[0] = current
        for bus in range(2):
            alive = supply > 0.0 and not failed("rel_esys" if bus == 0 else "rel_esys2")
            self.bus_volts[bus] = supply if alive else 0.0
            self.bus_amps[bus] = load / 2.0 if alive else 0.0


@dataclass(frozen=True)
class Seat:
    """The failures that act on one pilot's instruments, as leaves of `sim/operation/failures/`."""

    pitot: str
    static: str
    vacuum: str
    gauge: str  #: what the gauges' failures begin with


PILOT = Seat("rel_pitot", "rel_static", "rel_vacuum", "rel_ss_")
COPILOT = Seat("rel_pitot2", "rel_static2", "rel_vacuum2", "rel_cop_")


@dataclass
class Instruments:
    """What one pilot's instruments show, blocked tubes and failed gyros included."""

    seat: Seat = PILOT
    airspeed_kt: float = 0.0
    altitude_ft: float = 0.0
    vertical_speed_fpm: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    heading_deg: float = 0.0  #: magnetic
    turn_rate_deg_s: float = 0.0
    _trapped_total_pa: Optional[float] = None
    _trapped_static_pa: Optional[float] = None

    def update(self, frame: Frame, setting_inhg: float, failed: Failed) -> None:
        """Takes a new frame."""
        m = frame.m
        impact = m.pressure_pa * ((1.0 + 0.2 * m.mach**2) ** 3.5 - 1.0)
        total, static = m.pressure_pa + impact, m.pressure_pa
        self._trapped_total_pa = (self._trapped_total_pa or total) if failed(self.seat.pitot) else None
        self._trapped_static_pa = (self._trapped_static_pa or static) if failed(self.seat.static) else None
        blocked = self._trapped_total_pa is not None or self._trapped_static_pa is not None
        total = self._trapped_total_pa or total
        static = self._trapped_static_pa or static
        gauge = self.seat.gauge
        if not failed(gauge + "asi"):
            self.airspeed_kt = _calibrated_kt(total - static) if blocked else m.calibrated_airspeed_mps * MPS_TO_KT
        if not failed(gauge + "alt"):
            self.altitude_ft = indicated_altitude_m(static, setting_inhg * INHG_PA) * _M_TO_FT
        if not failed(gauge + "vvi"):
            self.vertical_speed_fpm = 0.0 if self._trapped_static_pa is not None else -m.v_down_mps * MPS_TO_FPM
        sucked = not failed(self.seat.vacuum)
        if sucked and not failed(gauge + "ahz"):
            self.pitch_deg, self.roll_deg = frame.true_theta, frame.true_phi
        if sucked and not failed(gauge + "dgy"):
            self.heading_deg = frame.mag_psi
        if not failed(gauge + "tsi"):
            self.turn_rate_deg_s = _turn_rate_deg_s(frame)


def _turn_rate_deg_s(frame: Frame) -> float:
    """Rate of the heading, right +."""
    m = frame.m
    steepness = max(abs(math.cos(m.pitch_rad)), 1e-3)
    rate = (m.q_rad_s * math.sin(m.roll_rad) + m.r_rad_s * math.cos(m.roll_rad)) / steepness
    return math.degrees(rate)


def _calibrated_kt(impact_pa: float) -> float:
    """Airspeed that an indicator shows for an impact pressure; 0 for suction."""
    if impact_pa <= 0.0:
        return 0.0
    return 340.294 * math.sqrt(5.0 * ((impact_pa / 101325.0 + 1.0) ** (2.0 / 7.0) - 1.0)) * MPS_TO_KT


@dataclass
class Weather:
    """Wind, turbulence and air as a client or the command line set them: the simulator's, not those of an aircraft."""

    wind_from_deg: float = 0.0
    wind_mps: float = 0.0  #: at every height
    turbulence_mps: float = 0.0  #: standard deviation of the vertical gust
    #: Difference from the standard temperature [K], pressure at sea level [Pa]; None: as the aircraft was made.
    air: Optional[Tuple[float, float]] = None

    def apply(self, model: FlightModel) -> None:
        """Gives an aircraft all of it."""
        self.blow(model)
        model.set_turbulence(self.turbulence_mps)
        if self.air is not None:
            model.set_atmosphere(*self.air)

    def blow(self, model: FlightModel) -> None:
        """Gives an aircraft the wind."""
        direction = math.radians(self.wind_from_deg)
        model.set_wind(-self.wind_mps * math.cos(direction), -self.wind_mps * math.sin(direction), 0.0)
