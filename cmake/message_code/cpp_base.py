"""What the C++ writers share, and the enumerations, bits and words."""

from typing import Dict, Iterable, List

from definitions import Constant, definition
from kinds import BITS, ENUMERATIONS, WORDS, Words

CORE = "xplane_bridge::core"
NODES = "xplane_bridge"


def camel(name: str) -> str:
    """AIR_VELOCITY, air_velocity: AirVelocity."""
    return "".join(part.capitalize() for part in name.replace("-", "").split("_"))


def comment(text: str) -> str:
    """The text as a comment behind a member."""
    return f"  ///< {text.strip()}" if text.strip() else ""


def lines(texts: Iterable[str], indent: int = 2) -> str:
    """Each text as a line."""
    return "".join(f"{' ' * indent}{text}\n" for text in texts)


def enumerators(values: Iterable[Constant], prefix: str = "", indent: int = 2) -> str:
    """The enumerators of an enumeration, a line each."""
    return lines((f"k{prefix}{camel(v.name)} = {v.value},{comment(v.comment)}" for v in values), indent)


def header(origin: str, includes: str, body: str, namespace: str = CORE) -> str:
    """A whole header. `includes`: names of headers, separated by blanks."""
    own = [name for name in includes.split() if name.startswith("xplane_bridge/")]
    system = [name for name in includes.split() if name not in own]
    included = "\n\n".join(
        filter(None, ["\n".join(f"#include <{n}>" for n in system), "\n".join(f'#include "{n}"' for n in own)])
    )
    return (
        f"// Made from {origin} by cmake/message_code; not to be edited.\n#pragma once\n\n{included}\n\n"
        f"namespace {namespace} {{\n\n{body}\n}}  // namespace {namespace}\n"
    )


def to_string(name: str, words: Dict[str, str]) -> str:
    """A function from the enumeration `name` to words; `words`: enumerator without k to word."""
    cases = lines((f'case {name}::k{value}:\n      return "{word}";' for value, word in words.items()), 4)
    return (
        f"constexpr const char* toString({name} value) {{\n  switch (value) {{\n{cases}  }}\n"
        '  return "unknown";\n}\n'
    )  # fmt: skip


def _words(kind: Words) -> str:
    words = kind.values
    known = lines(f'if (word == "{word}") return {kind.name}::k{camel(word)};' for word in words)
    function = kind.name[0].lower() + kind.name[1:] + "From"
    return (
        f"/// {kind.text} Words of {kind.message}.{kind.field}.\n"
        f"enum class {kind.name} : std::uint8_t {{\n{lines(f'k{camel(word)},' for word in words)}}};\n\n"
        f"{to_string(kind.name, {camel(word): word for word in words})}\n"
        "/// nullopt for another word.\n"
        f"constexpr std::optional<{kind.name}> {function}(std::string_view word) {{\n"
        f"{known}  return std::nullopt;\n}}\n"
        "/// All of them, for error texts.\n"
        f"inline constexpr const char* k{kind.name}Words =\n"
        f'    "{", ".join(words)}";\n'
    )


def constants() -> str:
    """The header of all enumerations, bits and words."""
    parts: List[str] = []
    for each in ENUMERATIONS:
        parts.append(
            f"/// {each.text} Numbers of {each.message}.\n"
            f"enum class {each.name} : std::uint8_t {{\n{enumerators(each.values)}}};\n"
        )
        if each.words:
            spelled = {camel(v.name): v.name.lower() if each.words == "lower" else v.name for v in each.values}
            parts.append(to_string(each.name, spelled))
    for bits in BITS:
        values = definition(bits.message).bits(bits.prefix)
        parts.append(
            f"/// {bits.text}\nenum {bits.name} : std::uint32_t {{\n{enumerators(values, bits.cpp_prefix)}}};\n"
        )
    parts += [_words(kind) for kind in WORDS]
    return header("msg/ and srv/", "cstdint optional string_view", "\n".join(parts))
