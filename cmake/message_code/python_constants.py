"""The Python that follows from the messages: src/xplane_bridge/constants.py."""

from definitions import Constant, Sources, definition
from kinds import BITS, ENUMERATIONS, WORDS, channels


def _class(name: str, base: str, text: str, values) -> str:
    lines = [f"    {v.name} = {v.value}" + (f"  #: {v.comment}" if v.comment else "") for v in values]
    return f'class {name}({base}):\n    """{text}"""\n\n' + "\n".join(lines) + "\n"


def _words(name: str, text: str, values) -> str:
    rows = "".join(f'    "{value}",\n' for value in values)
    return f"#: {text}\n{name} = (\n{rows})\n"


def python_file(sources: Sources) -> str:
    """The text of the module."""
    parts = []
    for each in ENUMERATIONS:
        parts.append(_class(each.name, "enum.IntEnum", f"{each.text} Numbers of {each.message}.", each.values))
    for bits in BITS:
        parts.append(_class(bits.name, "enum.IntFlag", bits.text, definition(bits.message).bits(bits.prefix)))
    for section in sources.sections:
        values = [Constant(bit.name, bit.value, bit.comment) for bit in section.bits]
        name = section.message.name
        parts.append(_class(f"{name}Valid", "enum.IntFlag", f"Bits of {name}.valid.", values))
    rows = "".join(f'    "{c.name}": CommandField(ControlField.{c.bit.name}, {c.low}, {c.high}),\n' for c in channels())
    command = (
        'class CommandField(NamedTuple):\n    """A scalar field of ControlCommand: its bit and its range."""\n\n'
        "    bit: ControlField\n    low: float\n    high: float\n\n\n"
        f"#: Every scalar field of ControlCommand.\nCOMMAND_FIELDS: Dict[str, CommandField] = {{\n{rows}}}\n"
    )
    helper = (
        "def words(numbers: Type[enum.IntEnum]) -> Dict[int, str]:\n"
        '    """Each number of an enumeration and its name in small letters."""\n'
        "    return {each.value: each.name.lower() for each in numbers}\n"
    )
    faults, shapes, disturbances = WORDS
    words = (
        _words("SURFACE_FAILURE_KINDS", "What a surface can do, SetFailure.kind.", faults.values)
        + '#: Every SetFailure.kind; "failed" is for whatever is no surface.\n'
        'FAILURE_KINDS = (*SURFACE_FAILURE_KINDS, "failed")\n'
        + _words("EXCITATION_KINDS", "Every InjectExcitation.kind that starts a signal.", shapes.values)
        + _words("DISTURBANCE_KINDS", "Every SetDisturbance.kind that starts one.", disturbances.values)
    )
    return (
        '"""Numbers and words of the messages, for programs that run without ROS.\n\n'
        "Made from msg/ and srv/ by cmake/message_code (`python3 cmake/message_code python`); not to be edited.\n"
        '"""\n\nfrom __future__ import annotations\n\nimport enum\nfrom typing import Dict, NamedTuple, Type\n\n\n'
        + "\n\n".join([*parts, helper, command])
        + words
    )
