"""The C++ of states: structs, field table and groups in the core, conversion and interpolation in the nodes."""

from typing import Callable, Dict, List, Tuple

from cpp_base import NODES, camel, comment, enumerators, header, lines
from definitions import HEADER, SOURCES, Field, Place, Section, Source, Sources
from kinds import ENUMERATIONS

_TYPES = {
    "bool": ("bool", "false"),
    "float32": ("float", "kNaNf"),
    "float64": ("double", "kNaN"),
    "geometry_msgs/Quaternion": ("Eigen::Quaterniond", "Eigen::Quaterniond(kNaN, kNaN, kNaN, kNaN)"),
    "geometry_msgs/Vector3": ("Eigen::Vector3d", "nanVector()"),
    "uint8": ("std::uint8_t", "0"),
    "uint32": ("std::uint32_t", "0"),
}
_BASE, _STATE, _MESSAGES = "xplane_bridge/core/base", "xplane_bridge/core/state", "xplane_bridge/nodes/messages"
_STAMP = ["std::int64_t stamp_ns = 0;  ///< host time of the simulator frame [ns]"]

# --- structs ---


def _member(message: str, field: Field) -> str:
    kind, unknown = _TYPES[field.type]
    for each in ENUMERATIONS:
        if each.message == message and each.prefix and field.comment.startswith(f"{each.prefix}*"):
            kind, unknown = each.name, f"{each.name}::k{camel(each.values[0].name)}"
    if field.size:
        kind, unknown = f"std::array<{kind}, {field.size}>", f"nanArray<{field.size}>()"
    return f"{kind} {field.name} = {unknown};{comment(field.comment)}"


def _struct(section: Section, base: str, members: List[str], more: str = "") -> str:
    every = sum(bit.value for bit in section.bits)
    return (
        f"/// As {section.message.name}.msg: names, units, frames and signs. What is not known is NaN, 0 or false.\n"
        f"struct {section.message.name}{base} {{\n"
        "  /// Bits of `valid`: set only when every field of the group is known and fresh.\n"
        f"  enum Valid : std::uint32_t {{\n{enumerators(section.bits, 'Valid', 4)}    kValidAll = {every},\n  }};\n"
        f"  static constexpr FieldGroup kGroup = FieldGroup::k{camel(section.group)};\n\n{lines(members)}{more}}};\n"
    )


def _flight_state(section: Section) -> str:
    members = [*_STAMP, "std::uint32_t valid = 0;"]
    members += [_member("FlightState", f) for f in section.message.fields.values() if f.name not in ("header", "valid")]
    has = "\n  bool has(std::uint32_t bits) const { return (valid & bits) == bits; }\n"
    return _struct(section, "", members, has)


def _mission_state(sections: List[Section]) -> str:
    common = [*_STAMP, "float sim_time = kNaNf;  ///< raw simulator time [s]", "std::uint32_t epoch = 0;"]
    common.append("std::uint32_t valid = 0;  ///< bits as in the message")
    structs = [f"/// What every mission message starts with.\nstruct MissionHeader {{\n{lines(common)}}};\n"]
    for section in sections:
        fields = [field for field in section.message.fields.values() if field.name not in HEADER]
        structs.append(_struct(section, " : MissionHeader", [_member(section.message.name, f) for f in fields]))
    return "\n".join(structs)


def _flight_inputs(section: Section) -> str:
    sources = [source for source in section.sources if source.kind != "computed"]
    members, groups = [], {}
    for source in sources:
        kind, unknown = ("double", "kNaN") if source.count == 1 else ("Eigen::Vector3d", "nanVector()")
        members.append(f"{kind} {source.names[0]} = {unknown};{comment(f'[{source.unit}] {source.remark}')}")
        if source.kind == "received" and source.bit:
            groups.setdefault(f"FlightState::kValid{camel(source.bit)}", []).append(source.names[0])
    taken = ""
    for flag, names in groups.items():
        known = " && ".join(f"isKnown(in.{name})" for name in names)
        copies = lines((f"takeField(in.{name}, s.{name});" for name in names), 4)
        taken += f"  if ((groups & {flag}) != 0 && {known}) {{\n{copies}    s.valid |= {flag};\n  }}\n"
    return (
        "/// What the flight group's sources deliver for one frame, whichever transport it came by. NaN: not carried.\n"
        "struct FlightInputs {\n"
        f"  static constexpr FieldGroup kGroup = FieldGroup::k{camel(section.group)};\n\n{lines(members)}}};\n\n"
        "/// Groups of FlightState with fields that are received as they are.\n"
        f"inline constexpr std::uint32_t kReceivedGroups =\n    {' | '.join(groups)};\n\n"
        "/// Copies these fields and sets the bits: of each of `groups` (bits of `valid`) all whose inputs are known.\n"
        f"inline void takeReceived(const FlightInputs& in, std::uint32_t groups, FlightState& s) {{\n{taken}}}\n"
    )


# --- field table ---


def _groups(sections: List[Section]) -> str:
    def switch(function: str, value: Callable[[Section], str], other: str) -> str:
        cases = lines((f"case FieldGroup::k{camel(s.group)}:\n      return {value(s)};" for s in sections), 4)
        return f"constexpr {function}(FieldGroup group) {{\n  switch (group) {{\n{cases}  }}\n  return {other};\n}}\n"

    return (
        "/// One group is one message, one set of requests, one rate.\n"
        f"enum class FieldGroup : std::uint8_t {{\n{lines(f'k{camel(s.group)},' for s in sections)}}};\n"
        f"inline constexpr std::size_t kFieldGroupCount = {len(sections)};\n\n"
        '/// Requests per second that mean "every frame": X-Plane caps at its frame rate.\n'
        "inline constexpr int kEveryFrame = 999;\n\n"
        "/// `flight`, `engines`, ...: parameter and topic names.\n"
        + switch("const char* toString", lambda s: f'"{s.group}"', '"unknown"')
        + "/// Name of the group's message type.\n"
        + switch("const char* messageName", lambda s: f'"{s.message.name}"', '"unknown"')
        + "/// Rate asked for unless a parameter says otherwise [1/s].\n"
        + switch("int defaultRate", lambda s: str(s.rate or "kEveryFrame"), "1")
    )


def _conversion(place: Place, wires: Dict[str, str]) -> str:
    return f'{{"{place.wire}", {wires[place.wire]}, 0.0}}' if place.wire else "{}"


def _datarefs(source: Source, wires: Dict[str, str]) -> str:
    found = []
    for place, first, end in source.datarefs:
        versions = f"{first}, {end}" if end else str(first) if first else ""
        found.append(f'{{"{place.at[0]}", {_conversion(place, wires)}, {{{versions}}}}}')
    return f"{{{{{', '.join(found)}}}}}"


def _row(source: Source, wires: Dict[str, str]) -> str:
    if not source.rows:
        return "{}"
    own = source.rows["11"]
    newer = source.rows.get("12", own)
    numbers = ", ".join(str(number) for number in (*own.at, *newer.at))
    flags = f"{str(source.bitfield).lower()}, {str(source.blank).lower()}"
    return f"{{{numbers}, {_conversion(own, wires)}, {_conversion(newer, wires)}, {source.slots}, {flags}}}"


def _field_lines(sources: Sources) -> str:
    rows = []
    for section in sources.sections:
        struct = "FlightInputs" if section.group == "flight" else section.message.name
        for s in section.sources:
            bit = f"{section.message.name}::kValid{camel(s.bit)}" if s.bit else "0"
            store = "nullptr" if s.kind == "computed" else f"storeMember<{struct}, &{struct}::{s.names[0]}>"
            remark = ("input: " if s.kind == "input" else "") + s.remark.replace("\\", "\\\\").replace('"', '\\"')
            head = f'FieldGroup::k{camel(section.group)}, "{", ".join(s.names)}", {s.count}, "{s.unit}", {bit}'
            flags = f"{str(s.kind == 'engine').lower()}, {str(s.kind == 'engines').lower()}"
            wire = f"{_datarefs(s, sources.wires)}, {_row(s, sources.wires)}"
            rows.append(f'{{{head}, {store},\n     {wire}, "{remark}", {flags}}},')
    text = "/// The lines of the field table, in the messages' order.\n"
    return f"{text}inline constexpr FieldSpec kFieldLines[] = {{\n{lines(rows, 4)}}};\n"


def state_headers(sources: Sources) -> Dict[str, str]:
    """The headers of core/state."""
    flight, missions = sources.sections[0], sources.sections[1:]
    structs = f"{_BASE}/message_constants.hpp {_BASE}/unknown.hpp {_STATE}/field_groups.hpp"
    contents: Dict[str, Tuple[str, str, str]] = {
        "field_groups": (SOURCES, "cstddef cstdint", _groups(sources.sections)),
        "flight_state": ("msg/FlightState.msg", f"Eigen/Core Eigen/Geometry cstdint {structs}", _flight_state(flight)),
        "mission_state": ("msg/", f"array cstdint {structs}", _mission_state(missions)),
        "flight_inputs": (
            SOURCES,
            f"Eigen/Core cstdint {_STATE}/field_store.hpp {_STATE}/flight_state.hpp",
            _flight_inputs(flight),
        ),
        "field_lines": (
            SOURCES,
            f"{_BASE}/units.hpp {_STATE}/field_table.hpp {_STATE}/flight_inputs.hpp {_STATE}/frames.hpp "
            f"{_STATE}/mission_state.hpp",
            _field_lines(sources),
        ),
    }
    return {f"{_STATE}/{name}.hpp": header(*content) for name, content in contents.items()}


# --- nodes ---


def state_messages_header(sources: Sources) -> str:
    """The header of the conversions to ROS."""
    names = [section.message.name for section in sources.sections]
    pairs = ",\n    ".join(f"std::pair<core::{name}, {name}>" for name in names[1:])
    body = (
        "// frame: frame_id, the body's axes FRD.\n"
        + lines((f"void toMessage(const core::{n}& state, const std::string& frame, {n}* message);" for n in names), 0)
        + f"\n/// Every mission state with its message.\nusing MissionMessages = std::tuple<\n    {pairs}>;\n"
    )
    own = " ".join([f"xplane_bridge/{n}.h" for n in names] + [f"{_STATE}/{n}_state.hpp" for n in ("flight", "mission")])
    return header("msg/", f"string tuple utility {own}", body, NODES)


def _to_message(section: Section) -> str:
    name = section.message.name
    copies = lines(
        f"putField(state.{field}, &message->{field});" for field in section.message.fields if field != "header"
    )
    return (
        f"void toMessage(const core::{name}& state, const std::string& frame, {name}* message) {{\n"
        "  message->header.stamp = toRosTime(state.stamp_ns);\n"
        f"  message->header.frame_id = frame;\n{copies}}}\n"
    )


def _interpolation(section: Section) -> str:
    steps = []
    for name, field in section.message.fields.items():
        if field.type == "geometry_msgs/Quaternion":
            steps.append(f"blend.attitude(&FlightState::{name});")
        elif field.range:
            steps.append(f"blend.angle(&FlightState::{name}, {field.range.split('..')[0]}.0);")
        elif field.type in ("float32", "float64", "geometry_msgs/Vector3"):
            steps.append(f"blend.linear(&FlightState::{name});")
    return (
        "FlightState interpolate(const FlightState& from, const FlightState& to, double fraction) {\n"
        "  FlightState result = fraction < 0.5 ? from : to;\n"
        "  const Blend blend(from, to, fraction, &result);\n"
        "  blend.stamp();\n"
        f"  result.valid = from.valid & to.valid;\n{lines(steps)}  return result;\n}}\n"
    )


def state_messages_source(sources: Sources) -> str:
    """The definitions of the conversions, and the interpolation."""
    headers = ("state_messages", "conversions", "field_blend", "field_copy", "flight_state_interpolation")
    conversions = "\n".join(_to_message(section) for section in sources.sections)
    return (
        "// Made from msg/ by cmake/message_code; not to be edited.\n\n"
        + lines((f'#include "{_MESSAGES}/{name}.hpp"' for name in headers), 0)
        + f"\nnamespace {NODES} {{\n\n{conversions}\n{_interpolation(sources.sections[0])}\n}}  // namespace {NODES}\n"
    )
