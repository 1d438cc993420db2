"""The truth file: what the flight model really did, frame by frame, in doubles, for tests and benchmarks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Callable, List, Tuple

from xplane_bridge.emulator.flight.flight_model import FlightModel
from xplane_bridge.emulator.flight.frame import Frame

#: Frames between two flushes of the file.
_FLUSH_EVERY = 10

_Source = Callable[[Frame], float]

#: Column name (with unit) and source. Attitude is relative to the local level.
COLUMNS: Tuple[Tuple[str, _Source], ...] = (
    ("frame", lambda f: f.clocks.frame),
    ("sim_time", lambda f: f.clocks.running),
    ("flight_time", lambda f: f.clocks.flight),
    ("frame_period", lambda f: f.clocks.simulated_period),
    ("paused", lambda f: int(f.clocks.paused)),
    ("latitude_deg", lambda f: f.m.latitude_deg),
    ("longitude_deg", lambda f: f.m.longitude_deg),
    ("altitude_m", lambda f: f.m.altitude_m),
    ("agl_m", lambda f: f.height),
    ("lat_ref_deg", lambda f: f.local.lat_ref),
    ("lon_ref_deg", lambda f: f.local.lon_ref),
    ("local_x_m", lambda f: f.position[0]),
    ("local_y_m", lambda f: f.position[1]),
    ("local_z_m", lambda f: f.position[2]),
    ("v_north_mps", lambda f: f.m.v_north_mps),
    ("v_east_mps", lambda f: f.m.v_east_mps),
    ("v_down_mps", lambda f: f.m.v_down_mps),
    ("roll_deg", lambda f: f.true_phi),
    ("pitch_deg", lambda f: f.true_theta),
    ("heading_deg", lambda f: f.true_psi),
    ("q_w", lambda f: f.m.quaternion[0]),
    ("q_x", lambda f: f.m.quaternion[1]),
    ("q_y", lambda f: f.m.quaternion[2]),
    ("q_z", lambda f: f.m.quaternion[3]),
    ("p_radps", lambda f: f.m.p_rad_s),
    ("q_radps", lambda f: f.m.q_rad_s),
    ("r_radps", lambda f: f.m.r_rad_s),
    ("p_dot_radps2", lambda f: f.m.p_dot_rad_s2),
    ("q_dot_radps2", lambda f: f.m.q_dot_rad_s2),
    ("r_dot_radps2", lambda f: f.m.r_dot_rad_s2),
    ("a_north_mps2", lambda f: f.m.acceleration_north_mps2),
    ("a_east_mps2", lambda f: f.m.acceleration_east_mps2),
    ("a_down_mps2", lambda f: f.m.acceleration_down_mps2),
    ("specific_force_x_mps2", lambda f: f.m.specific_force_x_mps2),
    ("specific_force_y_mps2", lambda f: f.m.specific_force_y_mps2),
    ("specific_force_z_mps2", lambda f: f.m.specific_force_z_mps2),
    ("wind_north_mps", lambda f: f.m.wind_north_mps),
    ("wind_east_mps", lambda f: f.m.wind_east_mps),
    ("wind_down_mps", lambda f: f.m.wind_down_mps),
    ("alpha_deg", lambda f: math.degrees(f.m.alpha_rad)),
    ("beta_deg", lambda f: math.degrees(f.m.beta_rad)),
    ("true_airspeed_mps", lambda f: f.m.true_airspeed_mps),
    ("calibrated_airspeed_mps", lambda f: f.m.calibrated_airspeed_mps),
    ("dynamic_pressure_pa", lambda f: f.m.dynamic_pressure_pa),
    ("air_density_kgpm3", lambda f: f.m.air_density_kg_m3),
    ("mass_kg", lambda f: f.m.mass_kg),
    ("on_ground", lambda f: int(f.m.on_ground_any)),
    ("thrust_n", lambda f: sum(engine.thrust_n for engine in f.m.engines)),
)
_SOURCES = tuple(source for _, source in COLUMNS)


class TruthFile:
    """Writes one CSV line a frame, from the first flight on.

    Columns: those of `COLUMNS`, one `surface_<name>_deg` for each surface of the first aircraft, and `host_time`: host
    time (since 1970, s) at which the frame began, nan in stepped mode.
    """

    def __init__(self, path: Path, model: FlightModel) -> None:
        try:
            self._file = path.open("w", encoding="ascii", newline="\n")
        except OSError as error:
            raise OSError(f"--truth {path}: cannot be written: {error.strerror or error}") from None
        self._surfaces: List[str] = [spec.name for spec in model.surfaces]
        names = [name for name, _ in COLUMNS]
        names += [f"surface_{name}_deg" for name in self._surfaces] + ["host_time"]
        self._file.write(",".join(names) + "\n")
        self._lines = 0

    def write(self, frame: Frame, host_time: float) -> None:
        """Writes one line."""
        values: List[float] = [source(frame) for source in _SOURCES]
        values += [frame.m.surfaces_deg.get(name, math.nan) for name in self._surfaces]
        values.append(host_time)
        self._file.write(",".join([repr(v) if type(v) is float else _text(v) for v in values]) + "\n")
        self._lines += 1
        if self._lines % _FLUSH_EVERY == 0:
            self._file.flush()

    def close(self) -> None:
        """Closes it."""
        self._file.close()


def _text(value: float) -> str:
    """A number as Python writes it (numpy's would have their type's name)."""
    return repr(value if isinstance(value, int) else float(value))
