"""What observations mean: each check takes the evidence and returns its findings; nothing here touches anything."""

from __future__ import annotations

from typing import Callable, FrozenSet, List, Tuple

from xplane_bridge.doctor.checks import clock, data_output, joystick, leftovers, link, ros, simulator, window
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Finding

Check = Callable[[Evidence], List[Finding]]

#: All checks, in the order of the report, from the cable to what is plugged in; each with the observations it needs.
CHECKS: Tuple[Tuple[Check, FrozenSet[str]], ...] = (
    (link.beacons, frozenset({"beacons"})),
    (link.several, frozenset({"beacons", "target"})),
    (link.answer, frozenset({"answers", "beacons", "target"})),
    (link.answering_address, frozenset({"answers", "target"})),
    (simulator.version, frozenset({"answers"})),
    (simulator.state, frozenset({"answers"})),
    (data_output.sending_port, frozenset({"data", "holders"})),
    (data_output.receiving_port, frozenset({"holders"})),
    (data_output.rows, frozenset({"answers", "data", "journals"})),
    (leftovers.journals, frozenset({"answers", "journals", "target"})),
    (leftovers.overrides, frozenset({"answers", "journals", "target"})),
    (ros.master, frozenset({"ros"})),
    (ros.own_name, frozenset({"computer", "ros"})),
    (ros.nodes, frozenset({"ros"})),
    (window.window, frozenset({"display", "target"})),
    (joystick.joystick, frozenset({"joysticks"})),
    (clock.clock, frozenset()),
)
