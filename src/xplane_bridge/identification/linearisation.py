"""The linear model of an aircraft of the emulator: trimmed, perturbed a little in every direction, and flown.

The flights of all perturbations together give the map from one frame to the next, and its logarithm A and B. A Jacobian
of the accelerations would not do: it lacks what the aircraft does inside (the lag of the downwash, the propeller's
governor), and is 1 % off in the short period and four times in the phugoid's damping.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Sequence

import numpy as np
from scipy.linalg import logm

from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import (
    FlightModel,
    FlightModelError,
    InitialState,
    ModelState,
    Side,
    SurfaceKind,
)
from xplane_bridge.emulator.flight.jsbsim_state import quaternion_from_euler
from xplane_bridge.identification.coefficients import Geometry, derivatives, mass_warning
from xplane_bridge.identification.model import (
    AXES,
    Axis,
    AxisModel,
    Estimate,
    IdentificationError,
    LinearModel,
    Signal,
    name_modes,
    signal_names,
    trim_estimates,
)

FRAME_S = 1.0 / 60.0
FLIGHT_S = 4.0
#: Frames of each flight that do not count: until then the aircraft's inside (downwash, propellers) still follows the
#: perturbation.
SETTLING_FRAMES = 12
#: Below this speed an aircraft does not fly on its wings, and angle of attack and sideslip say nothing [m/s].
SLOWEST_MPS = 20.0
#: How far each state and input is perturbed, in its unit.
PERTURBATIONS = {
    "true_airspeed": 0.5,
    "alpha": 0.002,
    "pitch_rate": 0.01,
    "pitch": 0.005,
    "beta": 0.002,
    "roll_rate": 0.01,
    "yaw_rate": 0.01,
    "roll": 0.005,
    "elevator": 0.002,
    "aileron": 0.002,
    "rudder": 0.002,
}
_STATES = [signal.name for axis in AXES.values() for signal in axis.states]
_INPUTS = [signal.name for axis in AXES.values() for signal in axis.inputs]
_KINDS = {"elevator": SurfaceKind.ELEVATOR, "aileron": SurfaceKind.AILERON, "rudder": SurfaceKind.RUDDER}


@dataclass(frozen=True)
class Condition:
    """What to linearise: SI units; None is the aircraft's usual value."""

    aircraft: str
    airspeed_mps: Optional[float] = None
    altitude_m: float = 1000.0
    fuel_kg: Optional[tuple[float, ...]] = None
    payload_kg: Optional[float] = None


def linearise(condition: Condition, geometry: Optional[Geometry] = None, scale: float = 1.0) -> LinearModel:
    """Work out the linear model of an aircraft of the emulator in trimmed level flight.

    Args:
        condition: The aircraft and how it flies.
        geometry: Its sizes, for derivatives as coefficients; none without.
        scale: Of the perturbations; another one must give the same model.

    Raises:
        IdentificationError: There is no such aircraft, no such flight, or nothing that a wing's angles describe.
    """
    try:
        model = create_model(condition.aircraft)
        if condition.fuel_kg is not None or condition.payload_kg is not None:
            model.set_loading(condition.fuel_kg, condition.payload_kg)
        model.reset(InitialState(altitude_m=condition.altitude_m, airspeed_mps=condition.airspeed_mps))
        return linearise_present(model, geometry, scale)
    except FlightModelError as error:
        raise IdentificationError(str(error)) from None


def linearise_present(model: FlightModel, geometry: Optional[Geometry] = None, scale: float = 1.0) -> LinearModel:
    """Work out the linear model of a flight model about where it has just been trimmed; see `linearise`."""
    speed = model.state.true_airspeed_mps
    if speed < SLOWEST_MPS:
        msg = (
            f"{model.info.name} is trimmed at {speed:.1f} m/s: expected at least {SLOWEST_MPS:.0f} m/s, where it flies "
            "on its wings (angles of attack and sideslip are states of the model); give a higher --speed"
        )
        raise IdentificationError(msg)
    flights = _Flights(model)
    have = [name for name in _INPUTS if flights.surfaces[name]]
    if not have:
        msg = f"{model.info.name} has no elevator, aileron or rudder: there is no input to linearise"
        raise IdentificationError(msg)
    sizes = {name: scale * PERTURBATIONS[name] for name in (*_STATES, *have)}
    runs = [flights.both_ways(name, size) for name, size in sizes.items()]
    trim = flights.trim()
    axes = {}
    for axis in AXES.values():
        inputs = tuple(signal for signal in axis.inputs if signal.name in have)
        axes[axis.name] = _axis_model(axis, inputs, runs, speed, flights.trimmed, geometry)
    source = {"program": "linearise_model", "frame_s": FRAME_S, "flight_s": FLIGHT_S, "perturbations": sizes}
    return LinearModel(model.info.name, trim, axes, source)


@dataclass
class _Run:
    """Half the difference of two flights perturbed both ways; columns by name, a row for each frame."""

    columns: dict[str, np.ndarray]


class _Flights:
    """Flies the perturbed aircraft again and again from the same trim point."""

    def __init__(self, model: FlightModel) -> None:
        self._model = model
        self._controls = model.trim_controls
        self.trimmed = model.state.copy()
        self._saved = model.save()
        self._values = _values(self.trimmed)
        #: Surfaces of an input, with the sign that each moves with.
        self.surfaces = {
            name: [(s.name, _sign(name, s.side)) for s in model.surfaces if s.kind is kind]
            for name, kind in _KINDS.items()
        }

    def trim(self) -> dict[str, Estimate]:
        """The trim point."""
        s, deg = self.trimmed, math.degrees
        deflection = {
            name: _mean([sign * s.surfaces_deg[surface] for surface, sign in surfaces])
            for name, surfaces in self.surfaces.items()
        }
        return trim_estimates(
            {
                "true_airspeed": (s.true_airspeed_mps, "m/s"),
                "altitude": (s.altitude_m, "m"),
                "alpha": (deg(s.alpha_rad), "deg"),
                "beta": (deg(s.beta_rad), "deg"),
                "pitch": (deg(s.pitch_rad), "deg"),
                "roll": (deg(s.roll_rad), "deg"),
                "flight_path": (deg(s.pitch_rad - s.alpha_rad), "deg"),
                "dynamic_pressure": (s.dynamic_pressure_pa, "Pa"),
                "air_density": (s.air_density_kg_m3, "kg/m^3"),
                "mass": (s.mass_kg, "kg"),
                **{name: (value, "deg") for name, value in deflection.items()},
            }
        )

    def both_ways(self, name: str, size: float) -> _Run:
        """Perturb one state or input up and down; what is even in the perturbation drops out."""
        up, down = self._fly(name, size), self._fly(name, -size)
        columns = {key: (up[key] - down[key]) / 2.0 for key in up}
        for other in _INPUTS:
            columns[other] = np.full(len(columns["alpha"]), size if other == name else 0.0)
        return _Run({key: column[SETTLING_FRAMES:] for key, column in columns.items()})

    def _fly(self, name: str, size: float) -> dict[str, np.ndarray]:
        model, controls = self._model, self._controls.copy()
        model.restore(self._saved)
        # The surfaces stand still whatever stabilises the aircraft.
        controls.override_surfaces = True
        controls.surface_deg = dict(self.trimmed.surfaces_deg)
        if name in _INPUTS:
            for surface, sign in self.surfaces[name]:
                controls.surface_deg[surface] += sign * math.degrees(size)
        else:
            self._place({**self._values, name: self._values[name] + size})
        rows = []
        for _ in range(round(FLIGHT_S / FRAME_S)):
            rows.append(_values(model.step(FRAME_S, controls)))
        return {key: np.array([row[key] for row in rows]) for key in rows[0]}

    def _place(self, v: dict[str, float]) -> None:
        speed, alpha, beta = v["true_airspeed"], v["alpha"], v["beta"]
        air = speed * np.array([math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta)])
        heading = self.trimmed.heading_rad
        self._model.place(
            roll_rad=v["roll"],
            pitch_rad=v["pitch"],
            heading_rad=heading,
            v_ned_mps=tuple(_to_ned(v["roll"], v["pitch"], heading) @ air),
            pqr_rad_s=(v["roll_rate"], v["pitch_rate"], v["yaw_rate"]),
        )


def _axis_model(
    axis: Axis,
    inputs: tuple[Signal, ...],
    runs: Sequence[_Run],
    speed: float,
    trimmed: ModelState,
    geometry: Optional[Geometry],
) -> AxisModel:
    states, forces, moved = (signal_names(signals) for signals in (axis.states, axis.forces, inputs))
    parts = [
        (
            np.column_stack([run.columns[n] for n in (*states, *moved)]),
            np.column_stack([run.columns[n] for n in forces]),
        )
        for run in runs
    ]
    now = np.vstack([part[:-1] for part, _ in parts])
    then = np.vstack([part[1:] for part, _ in parts])
    count = len(states)
    step = np.eye(now.shape[1])
    step[:count] = np.linalg.lstsq(now, then[:, :count], rcond=None)[0].T
    system = np.real(logm(step)) / FRAME_S
    output = np.linalg.lstsq(np.vstack([x for x, _ in parts]), np.vstack([y for _, y in parts]), rcond=None)[0].T
    a, b = system[:count, :count], system[:count, count:]
    c = np.vstack([np.eye(count), output[:, :count]])
    d = np.vstack([np.zeros((count, len(moved))), output[:, count:]])
    found = AxisModel(axis, inputs, a, b, c, d, name_modes(axis, a))
    if geometry is not None:
        pressure, mass = trimmed.dynamic_pressure_pa, trimmed.mass_kg
        found.derivatives = derivatives(found, geometry, speed, pressure, mass)
        found.warnings = mass_warning(geometry, mass)
    return found


def _values(s: ModelState) -> dict[str, float]:
    return {
        "true_airspeed": s.true_airspeed_mps,
        "alpha": s.alpha_rad,
        "pitch_rate": s.q_rad_s,
        "pitch": s.pitch_rad,
        "beta": s.beta_rad,
        "roll_rate": s.p_rad_s,
        "yaw_rate": s.r_rad_s,
        "roll": s.roll_rad,
        "specific_force_x": s.specific_force_x_mps2,
        "specific_force_y": s.specific_force_y_mps2,
        "specific_force_z": s.specific_force_z_mps2,
    }


def _sign(name: str, side: Side) -> float:
    """With which sign a surface's own angle (trailing edge down +, rudder right +) counts in an input."""
    if name == "aileron":
        return 1.0 if side is Side.LEFT else -1.0
    return -1.0 if name == "rudder" else 1.0


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else math.nan


def _to_ned(roll: float, pitch: float, heading: float) -> np.ndarray:
    w, x, y, z = quaternion_from_euler(roll, pitch, heading)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
