"""All that was observed: what the checks judge."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, Sequence

from xplane_bridge import protocol
from xplane_bridge.doctor.observe.beacons import BeaconWatch
from xplane_bridge.doctor.observe.clock import ClockWatch
from xplane_bridge.doctor.observe.computer import Computer
from xplane_bridge.doctor.observe.data_output import DataWatch
from xplane_bridge.doctor.observe.journals import Journal
from xplane_bridge.doctor.observe.joysticks import Joysticks
from xplane_bridge.doctor.observe.ports import Holder
from xplane_bridge.doctor.observe.ros import RosFacts
from xplane_bridge.doctor.observe.simulator import Answers
from xplane_bridge.doctor.observe.target import Target
from xplane_bridge.doctor.observe.windows import Display
from xplane_bridge.doctor.settings import Settings


@dataclass(frozen=True)
class Evidence:
    """All that was observed.

    Attributes:
        settings: What was looked for.
        computer: This computer.
        target: The X-Plane that is examined.
        beacons: What was heard on the beacon's multicast group.
        answers: What came back from `target`.
        holders: Programs that hold a UDP port of this computer, by port.
        data: Data Output rows that came meanwhile.
        data_port: The port on which the nodes receive Data Output rows.
        journals: The bridge's journals of this computer.
        ros: ROS master, names and nodes.
        display: X display and its windows.
        joysticks: Input devices.
        clock: The system's clock during the examination.
        unfinished: Observations that could not be made, with the reason.
    """

    settings: Settings = field(default_factory=Settings)
    computer: Computer = field(default_factory=Computer)
    target: Target = field(default_factory=Target)
    beacons: BeaconWatch = field(default_factory=BeaconWatch)
    answers: Answers = field(default_factory=Answers)
    holders: Dict[int, Sequence[Holder]] = field(default_factory=dict)
    data: DataWatch = field(default_factory=DataWatch)
    data_port: int = protocol.DATA_TARGET_PORT
    journals: Sequence[Journal] = ()
    ros: RosFacts = field(default_factory=RosFacts)
    display: Display = field(default_factory=Display)
    joysticks: Joysticks = field(default_factory=Joysticks)
    clock: ClockWatch = field(default_factory=ClockWatch)
    unfinished: Dict[str, str] = field(default_factory=dict)
