"""Propellers, rotors, and what turns them.

One model serves the twin's propellers, the quadrotor's rotors and the tiltrotor's proprotors: a representative blade
section at 75 % radius with true inflow angles (so high advance ratios and windmilling come out right), momentum
theory with Glauert's formula for the induced velocity, and first-order dynamic inflow. It is cheap (no iteration
inside a step) and all of its state can be saved.

Not modelled: vortex ring state beyond what Glauert's formula gives, blade flapping, compressibility.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

#: Share of the blade area that at the 75 % section's speed gives the whole thrust: int (r/R)^2 d(r/R) / 0.75^2.
SECTION_AREA = (1.0 / 3.0) / 0.75**2
#: Dynamic inflow lag [s] (Pitt and Peters give 0.85 R / (4 v_i): 0.02 to 0.1 s for rotors of these sizes).
INFLOW_LAG_S = 0.04


@dataclass(frozen=True)
class RotorSpec:
    """A rotor. Position from the model's reference point, FRD. ``direction`` +1: clockwise seen along the thrust."""

    forward_m: float
    right_m: float
    down_m: float
    direction: int
    radius_m: float
    blade_area_m2: float  #: all blades
    inertia_kg_m2: float  #: with what is fixed to the shaft
    lift_slope: float = 5.7  #: per rad
    max_lift: float = 1.3
    profile_drag: float = 0.012
    zero_lift_deg: float = -2.0  #: angle of the section without lift
    edgewise_drag: float = 0.1  #: in-plane force = this x density x blade area x tip speed x in-plane speed


class Rotor:
    """State and loads of one rotor. ``axis``: thrust direction in FRD, (cos nacelle, 0, -sin nacelle)."""

    __slots__ = (
        "axis_x",
        "axis_z",
        "blade_rad",
        "force_x",
        "force_y",
        "force_z",
        "inflow",
        "moment_x",
        "moment_y",
        "moment_z",
        "omega",
        "shaft_torque",
        "spec",
        "thrust",
        "torque",
        "x",
        "y",
        "z",
    )
    _SAVED = ("omega", "blade_rad", "inflow", "thrust", "torque", "shaft_torque", "axis_x", "axis_z", "x", "y", "z")

    def __init__(self, spec: RotorSpec, blade_deg: float) -> None:
        self.spec = spec
        self.omega = 0.0  #: rad/s, always >= 0
        self.blade_rad = math.radians(blade_deg)  #: at 75 % radius
        self.inflow = 0.0  #: induced velocity, m/s
        self.thrust = self.torque = self.shaft_torque = 0.0
        self.axis_x, self.axis_z = 1.0, 0.0
        self.x, self.y, self.z = spec.forward_m, spec.right_m, spec.down_m  #: of the hub; a nacelle moves it
        self.force_x = self.force_y = self.force_z = 0.0
        self.moment_x = self.moment_y = self.moment_z = 0.0

    def tilt(self, nacelle_rad: float) -> None:
        """Turns the thrust: 0 forward, pi / 2 up."""
        self.axis_x, self.axis_z = math.cos(nacelle_rad), -math.sin(nacelle_rad)

    def air_loads(self, dt: float, air: Sequence[float], rates: Sequence[float], density: float) -> None:
        """Thrust and aerodynamic torque at the present speed and blade angle; the induced velocity moves on by ``dt``.

        Args:
            dt: [s].
            air: velocity of the aircraft's reference point through the air, FRD [m/s].
            rates: p, q, r [rad/s].
            density: of the air [kg/m3].
        """
        spec, ax, az = self.spec, self.axis_x, self.axis_z
        p, q, r = rates
        x, y, z = self.x, self.y, self.z
        u = air[0] + q * z - r * y
        v = air[1] + r * x - p * z
        w = air[2] + p * y - q * x
        axial = u * ax + w * az
        plane_x, plane_z = u - axial * ax, w - axial * az
        plane_square = plane_x * plane_x + v * v + plane_z * plane_z
        through = axial + self.inflow
        section = 0.75 * spec.radius_m * self.omega
        phi = math.atan2(through, section + 1e-3)
        speed_square = section * section + through * through + 0.5 * plane_square
        alpha = self.blade_rad - phi - math.radians(spec.zero_lift_deg)
        sine, cosine = math.sin(alpha), math.cos(alpha)
        lift = spec.max_lift * math.tanh(spec.lift_slope * sine * cosine / spec.max_lift)
        drag = spec.profile_drag + 1.2 * sine**4 + 0.02 * lift * lift
        force = 0.5 * density * speed_square * spec.blade_area_m2 * SECTION_AREA
        sin_phi, cos_phi = math.sin(phi), math.cos(phi)
        self.thrust = thrust = force * (lift * cos_phi - drag * sin_phi)
        self.torque = 0.75 * spec.radius_m * force * (lift * sin_phi + drag * cos_phi)

        disc = math.pi * spec.radius_m * spec.radius_m
        hover_square = abs(thrust) / (2.0 * density * disc)
        # The floor keeps Glauert's formula finite where the air stands still in the disc (descent into the own wake).
        passing = math.sqrt(plane_square + through * through + 0.1 * hover_square + 0.01)
        induced = thrust / (2.0 * density * disc * passing)
        self.inflow += (induced - self.inflow) * min(dt / INFLOW_LAG_S, 1.0)

        along = spec.edgewise_drag * density * spec.blade_area_m2 * spec.radius_m * self.omega
        fx, fy, fz = thrust * ax - along * plane_x, -along * v, thrust * az - along * plane_z
        self.force_x, self.force_y, self.force_z = fx, fy, fz
        self.moment_x, self.moment_y, self.moment_z = y * fz - z * fy, z * fx - x * fz, x * fy - y * fx

    def turn(self, dt: float, shaft_torque: float, rates: Sequence[float]) -> None:
        """Speeds the shaft up by ``shaft_torque`` less the air's; adds reaction and gyroscopic moment to the loads."""
        spec = self.spec
        self.shaft_torque = shaft_torque
        self.omega = max(self.omega + (shaft_torque - self.torque) / spec.inertia_kg_m2 * dt, 0.0)
        p, q, r = rates
        reaction = -spec.direction * shaft_torque
        spin = spec.direction * spec.inertia_kg_m2 * self.omega
        hx, hz = spin * self.axis_x, spin * self.axis_z
        # -(rates x H), H = (hx, 0, hz)
        self.moment_x += reaction * self.axis_x - q * hz
        self.moment_y += -(r * hx - p * hz)
        self.moment_z += reaction * self.axis_z + q * hx

    def save(self) -> list[float]:
        """What ``restore`` needs."""
        return [getattr(self, name) for name in self._SAVED]

    def restore(self, saved: Sequence[float]) -> None:
        """Puts the rotor back into the state of ``save``."""
        for name, value in zip(self._SAVED, saved):
            setattr(self, name, value)


def sum_loads(rotors: Sequence[Rotor]) -> list[float]:
    """Forces [N] and moments about the reference point [N m] of all rotors, FRD."""
    total = [0.0] * 6
    for rotor in rotors:
        total[0] += rotor.force_x
        total[1] += rotor.force_y
        total[2] += rotor.force_z
        total[3] += rotor.moment_x
        total[4] += rotor.moment_y
        total[5] += rotor.moment_z
    return total


@dataclass(frozen=True)
class GovernorSpec:
    """Constant-speed governor: the blade angle holds the shaft speed."""

    minimum_rpm: float
    maximum_rpm: float
    fine_deg: float
    coarse_deg: float
    rate_deg_s: float = 12.0
    proportional: float = 0.06  #: deg per rad/s
    integral: float = 0.08  #: deg/s per rad/s


class Governor:
    """Proportional-integral governor without wind-up (the integral is the blade angle less the proportional part)."""

    __slots__ = ("integral_deg", "spec")

    def __init__(self, spec: GovernorSpec) -> None:
        self.spec = spec
        self.integral_deg = spec.fine_deg

    def step(self, dt: float, rotor: Rotor, lever: float) -> None:
        """Moves the rotor's blades; ``lever`` 0..1."""
        spec = self.spec
        wanted = spec.minimum_rpm + (spec.maximum_rpm - spec.minimum_rpm) * min(max(lever, 0.0), 1.0)
        error = rotor.omega - wanted * (math.pi / 30.0)
        self.integral_deg = min(max(self.integral_deg + spec.integral * error * dt, spec.fine_deg), spec.coarse_deg)
        blade = math.degrees(rotor.blade_rad)
        target = min(max(self.integral_deg + spec.proportional * error, spec.fine_deg), spec.coarse_deg)
        reach = spec.rate_deg_s * dt
        rotor.blade_rad = math.radians(blade + min(max(target - blade, -reach), reach))


@dataclass(frozen=True)
class PistonSpec:
    """A normally aspirated four-stroke; constants of the size of a 180 hp engine's handbook (our own estimates)."""

    rated_power_w: float
    rated_rpm: float
    fuel_kg_per_joule: float = 0.274 / 3.6e6  #: 0.45 lb per horsepower and hour
    closed_throttle: float = 0.24  #: manifold pressure at closed throttle over outside pressure
    open_throttle: float = 0.98
    friction: float = 0.18  #: share of the rated torque


class PistonEngine:
    """Shaft torque, fuel and instruments of one piston engine.

    With its ignition on and fuel it fires as soon as the shaft turns fast enough, so that a repaired engine whose
    propeller windmills runs again.
    """

    __slots__ = (
        "cht_k", "egt_k", "fuel_flow", "ignition", "manifold_pa", "oil_k", "oil_pa", "power", "running", "spec",
    )  # fmt: skip

    _SAVED = ("running", "manifold_pa", "egt_k", "cht_k", "oil_k", "oil_pa", "fuel_flow", "power", "ignition")
    STANDARD_PA = 101325.0
    FIRES_ABOVE = 0.1  #: of the rated speed

    def __init__(self, spec: PistonSpec) -> None:
        self.spec = spec
        self.running = self.ignition = False
        self.manifold_pa = self.STANDARD_PA
        self.egt_k = self.cht_k = self.oil_k = 288.15
        self.oil_pa = self.fuel_flow = self.power = 0.0

    def torque(
        self,
        dt: float,
        omega: float,
        throttle: float,
        mixture: float,
        pressure_pa: float,
        temperature_k: float,
        fuel: bool,
    ) -> float:
        """Torque on the shaft [N m] (negative: friction), and the instruments ``dt`` later."""
        spec = self.spec
        opening = min(max(throttle, 0.0), 1.0)
        rated_omega = spec.rated_rpm * (math.pi / 30.0)
        rated_torque = spec.rated_power_w / rated_omega
        speed = omega / rated_omega
        if not fuel or mixture < 0.05 or not self.ignition:
            self.running = False
        elif speed > self.FIRES_ABOVE:
            self.running = True
        # The intake cannot be pumped down while the shaft stands still.
        ratio = spec.closed_throttle + (spec.open_throttle - spec.closed_throttle) * opening
        self.manifold_pa = pressure_pa * (1.0 - (1.0 - ratio) * min(speed / 0.2, 1.0))
        friction = spec.friction * (0.6 + 0.4 * speed)
        drag = -friction * rated_torque * min(omega / 2.0, 1.0)
        indicated = 0.0
        if self.running:
            # Air limits: manifold pressure over the root of temperature. Best power at mixture 0.8, 8 % less rich.
            charge = self.manifold_pa / self.STANDARD_PA * math.sqrt(288.15 / temperature_k)
            richness = 1.0 - 2.0 * (min(mixture, 1.0) - 0.8) ** 2
            indicated = 1.235 * rated_torque * charge * max(richness, 0.0)
        torque = indicated + drag
        self.power = torque * omega
        self.fuel_flow = (
            indicated * omega * spec.fuel_kg_per_joule * (0.7 + 0.375 * min(mixture, 1.0)) if self.running else 0.0
        )
        load = max(self.power / spec.rated_power_w, 0.0)
        hot = 1.0 if self.running else 0.0
        self._lag("egt_k", temperature_k + hot * (560.0 + 340.0 * load + 80.0 * (0.8 - mixture)), dt, 3.0)
        self._lag("cht_k", temperature_k + hot * (70.0 + 95.0 * load), dt, 90.0)
        self._lag("oil_k", temperature_k + hot * (45.0 + 35.0 * load), dt, 200.0)
        self.oil_pa = 414e3 * min(speed / 0.6, 1.0) * (1.0 + 0.002 * (358.0 - self.oil_k))
        return torque

    def _lag(self, name: str, target: float, dt: float, time_constant: float) -> None:
        value = getattr(self, name)
        setattr(self, name, value + (target - value) * min(dt / time_constant, 1.0))

    def switch(self, on: bool) -> None:
        """Ignition on or off; on, the engine counts as running at once."""
        self.running = self.ignition = on

    def warm_up(self, temperature_k: float, load: float) -> None:
        """Instruments of an engine that has run at ``load`` (0..1 of rated power) for long."""
        self.egt_k = temperature_k + 560.0 + 340.0 * load
        self.cht_k = temperature_k + 70.0 + 95.0 * load
        self.oil_k = temperature_k + 45.0 + 35.0 * load

    def save(self) -> list[float]:
        """What ``restore`` needs."""
        return [getattr(self, name) for name in self._SAVED]

    def restore(self, saved: Sequence[float]) -> None:
        """Puts the engine back into the state of ``save``, also one without ignition, as they were saved before."""
        for name, value in zip(self._SAVED, [*saved, saved[0]]):
            setattr(self, name, value)


def electric_torque(rotor: Rotor, dt: float, wanted_omega: float, lag_s: float, maximum_torque: float) -> float:
    """Shaft torque of a motor whose speed controller reaches ``wanted_omega`` with a first-order lag, within its limit.

    A controller of the usual kind drives but hardly brakes: backwards it has a tenth of its torque.
    """
    inertia = rotor.spec.inertia_kg_m2
    wanted = rotor.torque + inertia * (wanted_omega - rotor.omega) / max(lag_s, dt)
    return min(max(wanted, -0.1 * maximum_torque), maximum_torque)
