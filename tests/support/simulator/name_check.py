"""Holds uses of X-Plane's datarefs and commands to X-Plane's lists."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Dict, Iterable, List, Mapping, Optional, Tuple

from xplane_bridge import xplane_names
from xplane_bridge.xplane_names import VERSIONS

#: What the lists call a unit, by the name that the package has for it.
UNITS: Dict[str, Tuple[str, ...]] = {
    "m": ("meters", "meter", "mtr"),
    "ft": ("feet",),
    "deg": ("degrees", "degs", "deg", "degrees_magnetic", "degm", "degt", "degrees(true)"),
    "deg magnetic": ("degrees_magnetic", "degm", "degrees"),
    "rad/s": ("rad/sec", "radians/second"),
    "deg/s": ("deg/sec",),
    "deg/s^2": ("deg/sec2",),
    "m/s": ("meters/sec", "meters/second", "mtr/sec", "m/s"),
    "kt": ("knots", "kts", "kias", "keas"),
    "ft/min": ("feet/minute", "fpm", "feet/min"),
    "s": ("seconds", "secs", "second"),
    "g": ("gs",),
    "psf": ("psf",),
    "psi": ("psi", "pounds/square_inch", "lb/in2"),
    "inHg": ("inhg", "inches_hg", "29.92+-...."),
    "Pa": ("pascals",),
    "N": ("newtons", "newton"),
    "N m": ("nm", "newton_meters", "newtonmeters", "newton-meters"),
    "W": ("watts",),
    "kg": ("kgs", "kg"),
    "l": ("liter",),
    "kg/s": ("kg/s", "kg/sec", "kilograms/second"),
    "rpm": ("revolutions/minute",),
    "%": ("percent", "prcnt"),
    "V": ("volts", "volt", "voltage"),
    "A": ("amps",),
    "deg C": ("degc_or_f", "degrees_c_or_f", "degreesc"),
    "px": ("pixels",),
    "nm": ("nautical_miles",),
    "sm": ("statute_miles",),
    "min": ("minutes", "mins"),
    "kHz": ("khz",),
    "10 kHz": ("10hertz", "10khz"),
    "dots": ("dots",),
    "h": ("hours",),
    "d": ("days",),
    "h, min, s": ("hours", "minutes", "seconds"),
    "code": ("transponder_code",),
    "character": ("string",),
    "1/6": ("coverage", "enum"),
    "0..10": ("[0", "float"),
    "-": ("boolean", "bool", "enum", "bitfield", "int", "count", "ratio", "multiplier", "mach", "mach_number", "epr"),
    "0, 1": ("boolean", "bool", "enum", "int"),
    "0..1": ("ratio", "[0..1]", "0..1", "0-1"),
    "0..1.5": ("[0..1.5]", "ratio"),
    "-0.5..1": ("[-0.5..1]", "ratio"),
    "-1..1": ("[-1..1]", "-1..1", "ratio"),
}


@dataclass(frozen=True)
class Use:
    """A dataref or command that something in the package uses.

    Attributes:
        where: What uses it.
        path: As sent to X-Plane, with `[i]` for an element.
        access: `read`, `write`, `command`, or `name` for what may be any of them.
        versions: That it is used with, of VERSIONS; `name` needs one of them only.
        unit: In which the value is taken, as in UNITS; "" where none is assumed.
        size: Elements the user believes it has; None: no belief.
    """

    where: str
    path: str
    access: str = "name"
    versions: Tuple[str, ...] = VERSIONS
    unit: str = ""
    size: Optional[int] = None


def problems(uses: Iterable[Use], exceptions: Mapping[str, str]) -> List[str]:
    """What is wrong with uses that `exceptions` (path -> reason) do not excuse, each problem once."""
    found = {}
    for use in uses:
        if use.path in exceptions:
            continue
        text = problem(use)
        if text:
            found[f"{use.where}: {use.path}: {text}"] = None
    return list(found)


def problem(use: Use) -> str:
    """What is wrong with one use; "" if nothing is."""
    texts = {version: _problem(use, version) for version in use.versions}
    if use.access == "name" and not all(texts.values()):
        return ""
    return next((f"{text} (list of {version})" for version, text in texts.items() if text), "")


def _problem(use: Use, version: str) -> str:
    if use.access == "command":
        return "" if use.path in xplane_names.commands(version) else "there is no such command"
    if use.access == "name" and use.path in xplane_names.commands(version):
        return ""
    facts = xplane_names.datarefs(version)
    name, index = use.path, None
    if name not in facts:  # the brackets may be part of the name
        match = re.fullmatch(r"(.+)\[(\d+)\]", use.path)
        if match:
            name, index = match.group(1), int(match.group(2))
    fact = facts.get(name)
    if fact is None:
        return "there is no such dataref"
    if index is not None and not fact.is_array and index > 0:
        return "it is not an array"
    if index is not None and fact.is_array and fact.size and index >= fact.size:
        return f"it has {fact.size} elements"
    if use.size is not None and fact.size and fact.size != use.size:
        return f"it has {fact.size} elements, not {use.size}"
    if use.access == "write" and fact.writable is False:
        return "it cannot be written"
    return _unit_problem(use.unit, fact.unit)


def _unit_problem(used: str, listed: str) -> str:
    if not used or not listed:
        return ""
    known = UNITS.get(used) or UNITS.get(used.split(", ")[0])  # "g, aft +" is in g
    if known is None:
        return f"unit '{used}' is not in UNITS"
    return "" if listed.lower() in known else f"its unit is '{listed}', taken as '{used}'"


def uses_in_dump(dump: str) -> List[Use]:
    """What the C++ program `simulator_names` printed."""
    uses: Dict[Tuple[str, str, str], List[str]] = {}
    for line in dump.splitlines():
        number, access, path, unit = line.split("\t")
        uses.setdefault((access, path, unit), []).append(xplane_names.version_of(int(number)))
    return [Use("C++", path, access, tuple(versions), unit) for (access, path, unit), versions in uses.items()]


_WORD = re.compile(r"(?<![\w/.])sim/[A-Za-z]\w*(?:/\w+)*/?(?:\[[^\]\s]*\]?|\{[^}\s]*\}?)*")
_SLICE = re.compile(r"\[(\d+)(?::(\d+))?\]")


def words_in(text: str) -> List[str]:
    """Everything in a text that looks like the name of a dataref or command, or the beginning of one."""
    return [match.group(0) for match in _WORD.finditer(text)]


def word_problem(word: str) -> str:
    """What is wrong with a word: it must be a name of some version, or what such names begin with up to `/` or `_`."""
    base = re.split(r"[\[{]", word)[0]
    rest = word[len(base) :]
    if rest.startswith("{") or base.endswith(("/", "_")) or "{" in rest:  # put together elsewhere
        return "" if any(name.startswith(base) for name in _union()) else "no name begins so"
    match = _SLICE.match(rest)
    last = 0 if match is None else int(match.group(1)) if match.group(2) is None else int(match.group(2)) - 1
    whole = Use("", base + rest)
    return problem(whole if not problem(whole) else Use("", f"{base}[{last}]" if last else base))


_UNION: List[str] = []


def _union() -> List[str]:
    if not _UNION:
        for version in VERSIONS:
            _UNION.extend(xplane_names.datarefs(version))
            _UNION.extend(xplane_names.commands(version))
    return _UNION
