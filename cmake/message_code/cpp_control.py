"""The C++ of commands: ControlCommand and its channels in the core, their conversion in the nodes."""

from typing import List, Tuple

from cpp_base import NODES, camel, comment, header, lines
from definitions import Constant, definition
from kinds import BY_ENGINE, ONE_LEVER, Channel, channels

_CHANNELS = """
constexpr Channel leverChannel(int engine) {
  return static_cast<Channel>(static_cast<int>(Channel::kLever0) + engine);
}
constexpr Channel motorChannel(int engine) {
  return static_cast<Channel>(static_cast<int>(Channel::kMotor0) + engine);
}

struct ChannelRange {
  double low, high;
};

/// A channel that is a scalar of ControlCommand: its bit, name and range.
struct ScalarChannel {
  Channel channel;
  std::uint32_t field;
  const char* name;
  double ControlCommand::*value;
  ChannelRange range;
};

/// Channels that an aircraft's YAML describes together.
struct ChannelSection {
  const char* name;
  Channel first, last;
};

/// What an input commands.
struct JoyTargetRow {
  JoyTarget target;
  const char* name;
  std::uint32_t field;
  double ControlCommand::*value;  ///< null: both brakes
  Channel range;                  ///< whose range it has
};
"""


def _array(kind: str, name: str, rows: List[str]) -> str:
    return f"\ninline constexpr {kind} {name}[] = {{\n{lines((f'{{{row}}},' for row in rows), 4)}}};\n"


def _command() -> str:
    types = {"float32": ("double", " = 0.0"), "uint8": ("int", " = 0"), "uint32": ("std::uint32_t", " = 0")}
    members = []
    for field in definition("ControlCommand").fields.values():
        if field.name == "header":
            continue
        kind, value = ("std::array<double, kMaxEngines>", "{}") if field.size else types[field.type]
        members.append(f"{kind} {field.name}{value};{comment(field.comment)}")
    return f"/// A command as it arrives, as ControlCommand.msg.\nstruct ControlCommand {{\n{lines(members)}}};\n\n"


def _channel_names() -> List[str]:
    """Enumerators in the message's order; one for the first engine where there is one for each."""
    names, after = [], ""
    for field in definition("ControlCommand").fields.values():
        if field.name in BY_ENGINE:
            names.append(f"k{BY_ENGINE[field.name]}0{after}")
            after = f" = k{BY_ENGINE[field.name]}0 + kMaxEngines"
        elif field.type == "float32" and field.name != ONE_LEVER:
            names.append(f"k{camel(field.name)}{after}")
            after = ""
    return [*names, "kCount"]


def _span(bit: Constant, own: List[Channel]) -> Tuple[str, str]:
    """First and last channel of a bit, to which the scalars `own` belong."""
    if own and own[0].name != ONE_LEVER:
        return f"Channel::k{camel(own[0].name)}", f"Channel::k{camel(own[-1].name)}"
    function = (BY_ENGINE["engine_throttles"] if own else BY_ENGINE[bit.name.lower()]).lower() + "Channel"
    return f"{function}(0)", f"{function}(kMaxEngines - 1)"


def control_fields() -> str:
    """The header of ControlCommand, its channels and what can be said of them."""
    bits, scalars = definition("ControlCommand").bits(""), channels()
    sections, targets = [], []
    for bit in bits:
        own = [scalar for scalar in scalars if scalar.bit == bit]
        first, last = _span(bit, own)
        if bit.name != "ENGINE_THROTTLES":  # THROTTLE's section describes these levers
            sections.append(f'"{bit.name.lower()}", {first}, {last}')
        if len(own) > 1:
            targets.append((bit.name.lower().split("_")[-1], bit, "nullptr", first))
        for scalar in own:
            channel = first if scalar.name == ONE_LEVER else f"Channel::k{camel(scalar.name)}"
            targets.append((scalar.name, bit, f"&ControlCommand::{scalar.name}", channel))
    lever = next(scalar for scalar in scalars if scalar.name == ONE_LEVER)
    rows = [
        f'Channel::k{camel(c.name)}, kField{camel(c.bit.name)}, "{c.name}", &ControlCommand::{c.name}, '
        f"{{{c.low}, {c.high}}}"
        for c in scalars
        if c.name != ONE_LEVER
    ]
    body = (
        f"inline constexpr std::uint32_t kAllFields = {sum(bit.value for bit in bits)};\n\n{_command()}"
        "/// One number that is sent to X-Plane. Levers and motors follow each other by engine: see leverChannel().\n"
        f"enum class Channel : std::uint8_t {{\n{lines(f'{name},' for name in _channel_names())}}};\n\n"
        "/// What an input can command: ControlCommand's scalars, with both toe brakes together as well.\n"
        f"enum class JoyTarget : std::uint8_t {{\n{lines(f'k{camel(target[0])},' for target in targets)}}};\n"
        + _CHANNELS
        + _array("ScalarChannel", "kScalarChannels", rows)
        + f"/// Of every lever and motor.\ninline constexpr ChannelRange kThrottleRange{{{lever.low}, {lever.high}}};\n"
        + _array("ChannelSection", "kChannelSections", sections)
        + _array(
            "JoyTargetRow",
            "kJoyTargets",
            [f'JoyTarget::k{camel(n)}, "{n}", kField{camel(b.name)}, {value}, {c}' for n, b, value, c in targets],
        )
    )
    base = "xplane_bridge/core/base"
    return header("msg/ControlCommand.msg", f"array cstdint {base}/limits.hpp {base}/message_constants.hpp", body)


def control_scalars() -> str:
    """The header by which the nodes copy scalars between messages and core."""
    copies = lines(f"copy(message.{c.name}, command.{c.name});" for c in channels())
    puts = lines(
        f"put(message.{c.name}, core::Channel::k{camel(c.name)});" for c in channels() if c.name != ONE_LEVER
    )  # fmt: skip
    body = (
        "/// Calls copy(of message, of command) for every scalar of ControlCommand.\n"
        "template <class Message, class Command, class Copy>\n"
        f"void forEachScalar(Message& message, Command& command, Copy copy) {{\n{copies}}}\n\n"
        "/// Calls put(of AppliedCommand, channel) for every channel that is a scalar.\n"
        f"template <class Message, class Put>\nvoid forEachChannel(Message& message, Put put) {{\n{puts}}}\n"
    )
    return header("msg/ControlCommand.msg", "xplane_bridge/core/control/control_fields.hpp", body, NODES)
