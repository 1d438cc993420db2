"""What a scenario demands of the flight: measured quantities with bounds, scored by run_scenario."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Optional, Tuple, Union

#: Measure to what it gives, for messages and tables; the unit is the variable's, or as said here.
MEASURES: Dict[str, str] = {
    "rms": "root mean square of variable - target",
    "peak": "largest |variable - target|",
    "overshoot": "how far the variable goes beyond the target, seen from where it was at the start of the window",
    "settling": "[s] from the start of the window until |variable - target| stays within `band`",
    "final": "mean of the last second of the window",
    "minimum": "lowest value",
    "maximum": "highest value",
    "paired": "share of images that carry a state (no window, no variable)",
    "perfect": "share of images of quality 0 (no window, no variable)",
}
#: Measures that compare with `target`.
TARGETED = ("rms", "peak", "overshoot", "settling")
#: Measures of the camera, not of a variable.
CAMERA = ("paired", "perfect")
#: Variables that can be measured: those that change continuously; conditions can look at them as well.
SCORED = (
    "roll",
    "pitch",
    "heading",
    "altitude",
    "agl",
    "climb",
    "speed",
    "alpha",
    "beta",
    "roll_rate",
    "pitch_rate",
    "yaw_rate",
    "load_factor",
)


@dataclass(frozen=True)
class Criterion:
    """One demand.

    Attributes:
        name: The key in the YAML.
        measure: A key of `MEASURES`.
        variable: One of `SCORED`, in the units of scenarios; empty for camera measures.
        target: In the variable's unit; angles (roll, heading) compare the short way round.
        start: Begin of the window: scenario time [s], or the label of an event.
        end: End of the window: likewise; None: the end of the flight.
        band: For `settling`, in the variable's unit.
        above: The measured value must be above this; None: no lower bound.
        below: The measured value must be below this; None: no upper bound.
    """

    name: str
    measure: str
    variable: str = ""
    target: float = 0.0
    start: Union[float, str] = 0.0
    end: Optional[Union[float, str]] = None
    band: float = 0.0
    above: Optional[float] = None
    below: Optional[float] = None

    @property
    def labels(self) -> Tuple[str, ...]:
        """The event labels that the window refers to."""
        return tuple(edge for edge in (self.start, self.end) if isinstance(edge, str))
