"""Which enumerations, bits and kinds are taken from the messages, and what they are called in C++ and Python."""

import re
from typing import List, NamedTuple, Tuple

from definitions import Constant, Definition, MessageError, definition


class Enumeration(NamedTuple):
    """Numbers of which a field holds one."""

    message: str
    prefix: str  #: of the constants; empty: all
    name: str
    text: str  #: what it is
    words: str  #: how toString() writes a value: upper, lower, or empty for no toString()

    @property
    def values(self) -> List[Constant]:
        """The constants, without prefix."""
        return definition(self.message).bits(self.prefix)


class Bits(NamedTuple):
    """Bits that a field adds up."""

    message: str
    prefix: str
    name: str
    cpp_prefix: str  #: of the enumerators after the k
    text: str


class Words(NamedTuple):
    """Words that a string field takes, as its comment lists them."""

    message: str
    field: str
    pattern: str  #: of the comment; its group holds the words
    name: str
    text: str

    @property
    def values(self) -> Tuple[str, ...]:
        """The words, in order."""
        comment = definition(self.message).fields[self.field].comment
        match = re.search(self.pattern, comment)
        if not match:
            raise MessageError(f"{self.message}.{self.field}: no words of the form {self.pattern} in: {comment}")
        return tuple(word.strip() for word in match.group(1).split(","))


ENUMERATIONS = (
    Enumeration("FlightState", "POSITION_", "PositionSource", "Where the position of a FlightState comes from.", ""),
    Enumeration("LinkState", "", "LinkState", "State of the link to X-Plane.", "upper"),
    Enumeration("ControlMode", "", "FlightMode", "Who flies.", "upper"),
    Enumeration("AppliedCommand", "SOURCE_", "CommandSource", "Where the values sent come from.", ""),
    Enumeration("SetFailure", "", "FailureTrigger", "When a failure comes true.", ""),
    Enumeration("ServiceResult", "", "ResultCode", "How a service call ended.", ""),
    Enumeration("Event", "", "EventKind", "What an event is about.", ""),
    Enumeration("FrameState", "VIEW_", "CameraView", "Where the pilot's camera looks.", "lower"),
)
BITS = (
    Bits("ControlCommand", "", "ControlField", "Field", "Bits of ControlCommand.fields."),
    Bits("FrameState", "QUALITY_", "ImageQuality", "Quality", "Bits of FrameState.quality; 0 is perfect."),
)
WORDS = (
    Words("SetFailure", "kind", r"surfaces: ([^;]+);", "SurfaceFault", "What a broken surface does."),
    Words("InjectExcitation", "kind", r"([^;]+);", "ExcitationShape", "Form of a test signal."),
    Words("SetDisturbance", "kind", r"([^;]+);", "DisturbanceKind", "What is added to the wind."),
)
#: Messages and services that repeat another's numbers.
REPEATED = (("ModeRequest", "ControlMode"), ("SetMode", "ControlMode"))


class Channel(NamedTuple):
    """A scalar field of ControlCommand."""

    name: str
    bit: Constant
    low: float
    high: float


#: Arrays of ControlCommand by engine, and what their channels are called.
BY_ENGINE = {"engine_throttles": "Lever", "motors": "Motor"}
#: All engines' levers at once: no channel of its own.
ONE_LEVER = "throttle"


def channels() -> List[Channel]:
    """The scalar fields of ControlCommand in order, with bit and range; `throttle` is among them."""
    command = definition("ControlCommand")
    bits = command.bits("")
    found = []
    for field in command.fields.values():
        if field.type != "float32":
            continue
        limits = re.match(r"\[(-?[\d.]+)\.\.(-?[\d.]+)\]", field.comment)
        own = [b for b in bits if b.name == field.name.upper() or re.search(rf"\b{field.name}\b", b.comment)]
        if not limits or len(own) != 1:
            raise MessageError(
                f"ControlCommand.{field.name}: expected a range as [-1..1] at the start of its comment, and one bit of "
                f"its name or with its name in the comment; found the bits {[b.name for b in own]}"
            )
        if field.size is None:
            found.append(Channel(field.name, own[0], float(limits.group(1)), float(limits.group(2))))
    return found


def check_repetitions() -> None:
    """Refuses numbers that messages repeat in another way."""
    for name, of in REPEATED:
        numbers = {(c.name, c.value) for c in definition(name).constants}
        wanted = {(c.name, c.value) for c in definition(of).constants}
        if numbers != wanted:
            raise MessageError(f"{name} has the constants {sorted(numbers)}, {of} {sorted(wanted)}: expected the same")
    applied: Definition = definition("AppliedCommand")
    for channel in channels():
        if channel.name != ONE_LEVER:
            applied.field(channel.name, "msg/ControlCommand.msg")
