"""Flights of the emulator's twin with test signals, as tables and as bags: what identify_model reads, without ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Table
from xplane_bridge.bags.flight import Flight
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import Controls, FlightModel, InitialState, ModelState
from xplane_bridge.scenario import excitations

if TYPE_CHECKING:
    from pathlib import Path

FRAME_S = 1.0 / 60.0
#: Simulator time at the start: late enough for float32 to have steps.
START_S = 1000.0
ALL_VALID = 262143


@dataclass(frozen=True)
class Manoeuvre:
    """A test signal on the stick, and how long the aircraft flies on after it."""

    target: str  #: pitch, roll, yaw; several with commas fly the same signal, each with its own seed
    amplitude: float = 0.1
    kind: str = "3-2-1-1"
    duration: float = 3.5
    tail: float = 2.5
    seed: int = 0
    frequency: float = 0.1
    frequency_end: float = 2.0


@dataclass
class Recording:
    """Rows of the topics, by role, as identify_model finds them in a bag."""

    state: list[dict[str, Any]] = field(default_factory=list)
    surfaces: list[dict[str, Any]] = field(default_factory=list)
    excitation: list[dict[str, Any]] = field(default_factory=list)
    mode: list[dict[str, Any]] = field(default_factory=list)
    fuel: list[dict[str, Any]] = field(default_factory=list)

    def flight(self, name: str = "flown") -> Flight:
        """As `bags.flight.read_flight` gives it."""
        tables = {}
        for role in ("state", "surfaces", "excitation", "mode", "fuel"):
            rows = getattr(self, role)
            if rows:
                columns = {key: np.array([row[key] for row in rows]) for key in rows[0] if key != "stamp"}
                stamp = np.array([row["stamp"] for row in rows], dtype=np.int64)
                tables[role] = Table(role, role, stamp, columns)
        return Flight(name, {}, {role: table.time for role, table in tables.items()}, tables)

    def write(self, path: Path) -> Path:
        """As a bag."""
        kinds = {
            "state": ("/xplane/flight_state", "FlightState"),
            "surfaces": ("/xplane/mission/surfaces", "SurfaceStates"),
            "excitation": ("/xplane/excitation/state", "ExcitationState"),
            "mode": ("/xplane/control/mode", "ControlMode"),
            "fuel": ("/xplane/mission/fuel", "FuelState"),
        }
        with FlightBag(path) as bag:
            for role, (topic, msgtype) in kinds.items():
                for k, row in enumerate(getattr(self, role)):
                    values = _nested({key: value for key, value in row.items() if key != "stamp"})
                    values["header"] = bag.header(row["stamp"], "base_link_frd", k)
                    bag.add(topic, f"xplane_bridge/{msgtype}", row["stamp"], values)
        return path


class Film:
    """A flight model that flies a flight once and then shows it: for flights that differ by the sensors' noise alone.

    Args:
        model: That flies; in calm air and without a controller in the loop, so that each flight is the same.
    """

    def __init__(self, model: FlightModel) -> None:
        self._model = model
        self._trims: list[Controls] = []
        self._states: list[ModelState] = []
        self._resets = self._shown = 0

    def again(self) -> Film:
        """From the start."""
        self._resets = self._shown = 0
        return self

    @property
    def state(self) -> ModelState:
        """As the model has it."""
        return self._states[self._shown - 1]

    def set_turbulence(self, strength: float) -> None:
        """Takes calm air."""
        assert strength == 0.0

    def reset(self, initial: InitialState) -> Controls:
        """As the model does it."""
        self._resets += 1
        if self._resets > len(self._trims):
            self._trims.append(self._model.reset(initial).copy())
        self._show()
        return self._trims[self._resets - 1].copy()

    def step(self, dt: float, controls: Controls) -> None:
        """As the model does it."""
        if self._shown == len(self._states):
            self._model.step(dt, controls)
        self._show()

    def _show(self) -> None:
        self._shown += 1
        if self._shown > len(self._states):
            self._states.append(self._model.state.copy())


class Pilot:
    """Flies manoeuvres one after the other, each from the same trimmed flight, in one recording.

    Args:
        model: A fixed-wing flight model; made once, for many recordings.
        turbulence: [m/s]
        noise: Of the sensors: 1 is 0.1 deg, 0.1 deg/s, 0.1 m/s rms.
        seed: Of turbulence and noise.
        surfaces_every: A sample of the surfaces every so many frames.
        shift: Frames by which the surfaces are too late.
        pitch_feedback: Stick per rad of pitch, a controller in the loop.
    """

    def __init__(
        self,
        model: FlightModel | Film | None = None,
        turbulence: float = 0.0,
        noise: float = 0.0,
        seed: int = 0,
        surfaces_every: int = 1,
        shift: int = 0,
        pitch_feedback: float = 0.0,
    ) -> None:
        self.model = create_model("fixed_wing") if model is None else model
        self.recording = Recording()
        self._turbulence, self._noise = turbulence, noise
        self._random = np.random.default_rng(seed)
        self._every, self._shift, self._feedback = surfaces_every, shift, pitch_feedback
        self._seed, self._frame, self._count = seed, 0, 0
        self._shown: list[dict[str, float]] = []

    def fly(self, manoeuvre: Manoeuvre) -> None:
        """One more manoeuvre."""
        model = self.model
        model.set_turbulence(0.0)
        controls = model.reset(InitialState(altitude_m=1000.0, airspeed_mps=75.0))
        pitch = model.state.pitch_rad
        self._count += 1
        if self._turbulence:
            model.set_turbulence(self._turbulence, 1000 * self._seed + self._count)
            for _ in range(30):
                model.step(FRAME_S, controls)
        self._frame += 60  # a second of its own between two manoeuvres, and an epoch
        self._record()
        start = float(np.float32(START_S + self._frame * FRAME_S))
        self._label(manoeuvre, start, None)
        frames = round(manoeuvre.duration / FRAME_S)
        axes = manoeuvre.target.split(",")
        signals = [_signal(manoeuvre, k) for k in range(len(axes))]
        for k in range(frames + round(manoeuvre.tail / FRAME_S)):
            for axis, signal in zip(axes, signals):
                setattr(controls, axis, excitations.value(signal, k * FRAME_S))
            controls.pitch -= self._feedback * (model.state.pitch_rad - pitch)
            model.step(FRAME_S, controls)
            self._frame += 1
            self._record()
            if k == frames - 1:
                self._label(manoeuvre, start, START_S + self._frame * FRAME_S)

    def _label(self, manoeuvre: Manoeuvre, start: float, end: float | None) -> None:
        self.recording.excitation.append(
            {
                "stamp": self._stamp(),
                "sim_time": np.float32(START_S + self._frame * FRAME_S),
                "active": end is None,
                "id": self._count,
                "kind": manoeuvre.kind,
                "target": manoeuvre.target,
                "amplitude": np.float32(manoeuvre.amplitude),
                "duration": np.float32(manoeuvre.duration),
                "start_sim_time": np.float32(start),
                "end_sim_time": np.float32(math.nan if end is None else end),
                "result": "running" if end is None else "done",
            }
        )

    def _stamp(self) -> int:
        return stamp_ns(self._frame * FRAME_S)

    def _record(self) -> None:
        s, noise = self.model.state, self._noise
        time = START_S + self._frame * FRAME_S
        self.recording.state.append(_state(s, self._stamp(), time, self._count, noise, self._random))
        self._shown.append({name: float(np.float32(value)) for name, value in s.surfaces_deg.items()})
        if self._frame % self._every == 0:
            shown = self._shown[max(len(self._shown) - 1 - self._shift, 0)]
            self.recording.surfaces.append(_surfaces(shown, self._stamp(), time, self._count))
        if not self.recording.fuel:
            mass = {"total_mass": np.float32(s.mass_kg), "valid": 2}
            self.recording.fuel.append({"stamp": self._stamp(), "sim_time": np.float32(time), **mass})


def _signal(manoeuvre: Manoeuvre, k: int) -> dict[str, Any]:
    m = replace(manoeuvre, seed=manoeuvre.seed + k)
    return {name: getattr(m, name) for name in ("kind", "amplitude", "duration", "seed", "frequency", "frequency_end")}


def _state(
    s: ModelState, stamp: int, time: float, epoch: int, noise: float, chance: np.random.Generator
) -> dict[str, Any]:
    angle, rate, speed = noise * 0.1, noise * math.radians(0.1), noise * 0.1
    alpha = s.alpha_rad + math.radians(angle) * chance.normal()
    beta = s.beta_rad + math.radians(angle) * chance.normal()
    air = s.true_airspeed_mps + speed * chance.normal()
    values = {
        "air_velocity_body.x": air * math.cos(alpha) * math.cos(beta),
        "air_velocity_body.y": air * math.sin(beta),
        "air_velocity_body.z": air * math.sin(alpha) * math.cos(beta),
        "angular_velocity.x": s.p_rad_s + rate * chance.normal(),
        "angular_velocity.y": s.q_rad_s + rate * chance.normal(),
        "angular_velocity.z": s.r_rad_s + rate * chance.normal(),
        "roll_deg": math.degrees(s.roll_rad) + angle * chance.normal(),
        "pitch_deg": math.degrees(s.pitch_rad) + angle * chance.normal(),
        "specific_force.x": s.specific_force_x_mps2,
        "specific_force.y": s.specific_force_y_mps2,
        "specific_force.z": s.specific_force_z_mps2,
        "wind_ned.x": s.wind_north_mps,
        "wind_ned.y": s.wind_east_mps,
        "wind_ned.z": s.wind_down_mps,
        "altitude_msl": s.altitude_m,
        "flight_path_angle_deg": math.degrees(math.atan2(-s.v_down_mps, math.hypot(s.v_north_mps, s.v_east_mps))),
        "dynamic_pressure": s.dynamic_pressure_pa,
        "air_density": s.air_density_kg_m3,
    }
    # As they come from datarefs.
    out: dict[str, Any] = {name: float(np.float32(value)) for name, value in values.items()}
    out.update(stamp=stamp, valid=ALL_VALID, sim_time=np.float32(time), sim_time_unwrapped=time, epoch=epoch)
    out.update(paused=False, replay=False, on_ground=False)
    return out


def _surfaces(deg: dict[str, float], stamp: int, time: float, epoch: int) -> dict[str, Any]:
    return {
        "stamp": stamp,
        "sim_time": np.float32(time),
        "epoch": epoch,
        "valid": 2047,
        "delta_aileron": np.float32((deg["wing2l_ail1"] - deg["wing2r_ail1"]) / 2.0),
        "delta_elevator": np.float32((deg["hstab1_elv1"] + deg["hstab2_elv1"]) / 2.0),
        "delta_rudder": np.float32(-deg["vstab1_rud1"]),
    }


def _nested(values: dict[str, Any]) -> dict[str, Any]:
    """Columns by path as nested values of a message."""
    out: dict[str, Any] = {}
    for name, value in values.items():
        first, _, rest = name.partition(".")
        if rest:
            out.setdefault(first, {})[rest] = value
        else:
            out[first] = value
    return out


#: What the tests of budgets fly, as config/scenarios/identification.yaml does: a small 3-2-1-1 and a doublet on each
#: input, and one more for validation.
PITCH, ROLL, YAW = (
    (
        Manoeuvre(axis, size),
        Manoeuvre(axis, 0.1, "doublet", 2.0),
        Manoeuvre(axis, size),
    )
    for axis, size in (("pitch", 0.05), ("roll", 0.1), ("yaw", 0.1))
)
LATERAL = ROLL + YAW


def flown(manoeuvres: tuple[Manoeuvre, ...], **options: Any) -> Recording:
    """The recording of a flight with these manoeuvres; options as of `Pilot`."""
    pilot = Pilot(**options)
    for manoeuvre in manoeuvres:
        pilot.fly(manoeuvre)
    return pilot.recording
