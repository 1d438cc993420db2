"""Where an aircraft touches the ground: gear states, and what counts as a crash."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree

from xplane_bridge.emulator.flight.flight_model import Controls, GearState, ModelState
from xplane_bridge.emulator.flight.jsbsim_state import Properties
from xplane_bridge.units import FOOT_M

#: A structural part that meets the ground faster than this, or gear faster than the second, is a crash [m/s].
CRASH_STRUCTURE_MPS = 2.0
CRASH_GEAR_MPS = 6.0
#: Cosine of the tilt beyond which the wheels no longer carry.
STRUTS_WORK_COSINE = 0.5


class Contact:
    """A contact point of the aircraft's XML; one that ``ModelInfo.gear_names`` lists is gear."""

    def __init__(self, element: ElementTree.Element, index: int, gear_names: tuple[str, ...], properties: Properties):
        def value(tag: str) -> float:
            return float(element.findtext(tag, "0"))

        self.name = element.get("name", "")
        # From JSBSim's structural frame (aft, right, up) to FRD.
        self.forward_m = -float(element.findtext("location/x", "0"))
        self.right_m = float(element.findtext("location/y", "0"))
        self.down_m = -float(element.findtext("location/z", "0"))
        self.is_gear = self.name in gear_names
        self.spring = value("spring_coeff")
        self.damping = value("damping_coeff")
        self.max_steer_deg = value("max_steer")
        unit = f"{'gear' if element.get('type') == 'BOGEY' else 'contact'}/unit[{index}]"
        self.wow = properties.getter(f"{unit}/WOW")
        self.compression = properties.getter(f"{unit}/compression-ft")
        self.compression_rate = properties.getter(f"{unit}/compression-velocity-fps")


class Contacts:
    """All contact points of an aircraft."""

    def __init__(self, tree: ElementTree.Element, gear_names: tuple[str, ...], properties: Properties) -> None:
        elements = tree.findall("ground_reactions/contact")
        self._all = [Contact(element, i, gear_names, properties) for i, element in enumerate(elements)]
        self._gear = [contact for contact in self._all if contact.is_gear]

    def new_states(self) -> list[GearState]:
        """One state per wheel or leg, to be filled in by ``read``."""
        return [GearState(name=contact.name) for contact in self._gear]

    def depth(self, roll_rad: float, pitch_rad: float) -> float:
        """How far the lowest point is below the reference point in this attitude [m]."""
        forward = -math.sin(pitch_rad)
        right = math.sin(roll_rad) * math.cos(pitch_rad)
        down = math.cos(roll_rad) * math.cos(pitch_rad)
        return max(forward * c.forward_m + right * c.right_m + down * c.down_m for c in self._all)

    def hit(self) -> bool:
        """Whether something touches the ground right now harder than it can take."""
        for contact in self._all:
            if contact.wow() > 0.5:
                limit = CRASH_GEAR_MPS if contact.is_gear else CRASH_STRUCTURE_MPS
                if contact.compression_rate() * FOOT_M > limit:
                    return True
        return False

    def read(self, s: ModelState, extended: float, steer: float) -> None:
        """Fills in the gear of ``s``. ``extended`` 0..1; ``steer`` -1..1."""
        standing = 0
        for contact, gear in zip(self._gear, s.gear):
            gear.extended = extended
            gear.on_ground = contact.wow() > 0.5
            gear.compression_m = contact.compression() * FOOT_M if gear.on_ground else 0.0
            rate = contact.compression_rate() * FOOT_M
            gear.vertical_force_n = (
                max(contact.spring * gear.compression_m + contact.damping * rate, 0.0) if gear.on_ground else 0.0
            )
            gear.steer_deg = contact.max_steer_deg * steer
            standing += gear.on_ground
        s.on_ground_any, s.on_ground_all = standing > 0, standing == len(self._gear)


class LandingGear:
    """Legs, brakes and the nose wheel's steering.

    Args:
        properties: JSBSim's.
        travel_s: How long the legs travel; 0: they are fixed.

    Attributes:
        position: 1 extended, 0 retracted.
        steering: Of the nose wheel, -1 to 1 (right).
    """

    def __init__(self, properties: Properties, travel_s: float) -> None:
        self._travel_s = travel_s
        self._set_extension = properties.setter("gear/gear-pos-norm")
        self._set_brakes = [properties.setter(f"fcs/{side}-brake-cmd-norm") for side in ("left", "right")]
        self._set_steering = properties.setter("fcs/steer-cmd-norm")
        self.position, self.steering = 1.0, 0.0

    def put(self, position: float) -> None:
        """Sets the legs at once."""
        self.position = position
        self._set_extension(position)

    def move(self, dt: float, controls: Controls, ground_speed: float) -> None:
        """Flies on: legs travel, brakes and wheel follow at once. Speed in m/s."""
        if self._travel_s > 0.0 and not controls.gear_fault:
            wanted, reach = (1.0 if controls.gear_down else 0.0), dt / self._travel_s
            self.position += min(max(wanted - self.position, -reach), reach)
        for setter, brake in zip(self._set_brakes, (controls.brake_left, controls.brake_right)):
            setter(min(max(brake, controls.parking_brake, 0.0), 1.0))
        # Nose wheel and rudder share the pedals; the wheel's share fades with speed as its tyre would skid.
        self.steering = min(max(controls.yaw, -1.0), 1.0) / (1.0 + (ground_speed / 12.0) ** 2)
        self._set_steering(self.steering)

    def set_struts(self, roll_rad: float, pitch_rad: float, near_ground: bool) -> None:
        """JSBSim measures compression along the strut: on its side an aircraft would stand on metres of it."""
        tilted = math.cos(roll_rad) * math.cos(pitch_rad) < STRUTS_WORK_COSINE
        self._set_extension(0.0 if tilted and near_ground else self.position)
