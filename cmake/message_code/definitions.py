"""Reads msg/, srv/ and lib/core/state/sources.txt, and refuses what does not fit together."""

import re
from difflib import get_close_matches
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

ROOT = Path(__file__).resolve().parents[2]
SOURCES = "lib/core/state/sources.txt"

#: As FieldSpec::datarefs has room for.
MOST_DATAREFS = 2

#: Every mission message starts with these; core::MissionHeader holds them.
HEADER = ("header", "sim_time", "epoch", "valid")

_LINE = re.compile(
    r"^(?P<type>[\w/]+)(\[(?P<size>\d*)\])?\s+(?P<name>\w+)\s*(=\s*(?P<value>\S+)\s*)?(#\s*(?P<comment>.*))?$"
)
_FIELD = re.compile(r"^(?P<name>\w+)(\[(?P<count>\d+)\])?(\s+\[(?P<unit>[^\]]+)\])?$")
_DATAREF = re.compile(r"^(?P<path>[^\s()]+)( \((?P<wire>[^)]+)\))?$")
_FROM = re.compile(r"^(?P<version>\d+(\.\d\d)?): (?P<rest>.+)$")
_ROW = re.compile(
    r"^(?P<row>\d+)\.(?P<slot>[0-7])(-(?P<last>[0-7]))?(?P<bits> bits)?(?P<blank> blank)?( \((?P<wire>[^)]+)\))?$"
)
_SECTION = re.compile(r"^\[(?P<message>\w+): (?P<group>\w+), (?P<rate>every frame|\d+/s)\]$")


class MessageError(Exception):
    """Something in the files does not fit: says where, what was given, and what to do."""


class Field(NamedTuple):
    """A field of a message."""

    type: str
    size: Optional[int]  #: of an array; None: a scalar
    name: str
    comment: str
    is_list: bool = False  #: an array of any length

    @property
    def unit(self) -> str:
        """What its comment has in brackets, without the brackets."""
        match = re.match(r"\[([^\]]*)\]", self.comment)
        return match.group(1) if match else "-"

    @property
    def range(self) -> str:
        """The angles it takes, ``0..360`` or ``-180..180``, where its comment begins with them; else empty."""
        match = re.match(r"\[deg\] (0\.\.360|-180\.\.180)\b", self.comment)
        return match.group(1) if match else ""


class Constant(NamedTuple):
    """A constant of a message."""

    name: str
    value: int
    comment: str


class Definition(NamedTuple):
    """A message, or the request of a service."""

    name: str
    fields: Dict[str, Field]
    constants: List[Constant]

    def field(self, name: str, where: str) -> Field:
        """The field of that name; `where` is what names it, for the error."""
        if name in self.fields:
            return self.fields[name]
        close = get_close_matches(name, self.fields, 2, 0.5)
        hint = f" (did you mean {' or '.join(close)}?)" if close else ""
        raise MessageError(
            f"{where}: {self.name} has no field {name}{hint}: correct the name, or write the field there"
        )

    def bits(self, prefix: str) -> List[Constant]:
        """The constants with that prefix, without it and without the one for all, which they must make up."""
        every = next((c for c in self.constants if c.name in (f"{prefix}ALL", "ALL_FIELDS")), None)
        bits = [
            c._replace(name=c.name[len(prefix) :]) for c in self.constants if c.name.startswith(prefix) and c != every
        ]
        if bits and every is not None and sum(bit.value for bit in bits) != every.value:
            raise MessageError(f"{self.name}: {every.name} is {every.value}, expected {sum(b.value for b in bits)}")
        return bits


class Place(NamedTuple):
    """A dataref or a slot, and the unit on the wire (empty: the field's)."""

    at: Tuple[object, ...]
    wire: str


class Dataref(NamedTuple):
    """A dataref of a field, and the versions of X-Plane that have it."""

    place: Place
    first: int  #: version as X-Plane numbers itself: 120800 is 12.08; 0: all before `end`
    end: Optional[int]  #: the first that has another, or none; None: the newest has it


class Source(NamedTuple):
    """A line of the sources."""

    where: str
    names: Tuple[str, ...]  #: several only where computed
    kind: str  #: received, input, computed, engines or engine
    bit: str  #: without VALID_; empty: none
    count: int
    unit: str
    datarefs: List[Dataref]
    rows: Dict[str, Place]  #: by X-Plane's version, "11" and "12"; at: row, slot
    slots: int  #: elements that the row carries
    bitfield: bool
    blank: bool
    remark: str


class Section(NamedTuple):
    """A message with the lines of its fields."""

    message: Definition
    group: str
    rate: Optional[int]  #: [1/s]; None: every frame
    sources: List[Source]
    bits: List[Constant]  #: of `valid`


class Sources(NamedTuple):
    """All of lib/core/state/sources.txt."""

    wires: Dict[str, str]  #: unit on the wire to its factor, a C++ expression
    sections: List[Section]


def read_definition(path: Path) -> Definition:
    """Reads a .msg, or the request of a .srv."""
    return read_lines(path.stem, path.read_text(encoding="utf-8").split("\n---\n")[0], path.name)


def read_lines(name: str, text: str, where: str) -> Definition:
    """Reads the text of a definition; `where` is what names it, for the error."""
    fields: Dict[str, Field] = {}
    constants: List[Constant] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        match = _LINE.match(line)
        if not match:
            raise MessageError(f"{where}:{number}: neither a field nor a constant: {line}")
        entry, comment = match["name"], match["comment"] or ""
        if match["value"]:
            constants.append(Constant(entry, int(match["value"]), comment))
        else:
            size = int(match["size"]) if match["size"] else None
            fields[entry] = Field(match["type"], size, entry, comment, match["size"] == "")
    return Definition(name, fields, constants)


def definition(name: str, root: Path = ROOT) -> Definition:
    """The message or service request of that name."""
    message = root / "msg" / f"{name}.msg"
    return read_definition(message if message.is_file() else root / "srv" / f"{name}.srv")


def read_sources(root: Path = ROOT) -> Sources:
    """Reads the sources with the messages they are of, and checks that no field is forgotten."""
    wires: Dict[str, str] = {}
    sections: List[Section] = []
    for number, line in enumerate((root / SOURCES).read_text(encoding="utf-8").splitlines(), 1):
        where = f"{SOURCES}:{number}"
        if not line.strip() or line.startswith("#") or line == "[wire units]":
            continue
        section = _SECTION.match(line)
        if section:
            message = definition(section["message"], root)
            rate = None if section["rate"] == "every frame" else int(section["rate"][:-2])
            sections.append(Section(message, section["group"], rate, [], []))
        elif not sections:
            name, _, factor = line.rpartition(" = ")
            wires[name] = factor
        else:
            sections[-1].sources.append(_source(line, where, sections[-1].message, wires))
    return Sources(wires, [_checked(section) for section in sections])


def _source(line: str, where: str, message: Definition, wires: Dict[str, str]) -> Source:
    cells = [cell.strip() for cell in line.split("|", 4)]
    if len(cells) != 5:
        raise MessageError(f"{where}: expected `field | validity | dataref | row | remarks`: {line}")
    names, kind, bit, count, unit = _what(cells[0], cells[1], where, message)
    datarefs = _datarefs(cells[2], where)
    rows, slots, bitfield, blank = {}, 0, False, False
    for version, m in _places(cells[3], _ROW, where):
        rows[version] = Place((int(m["row"]), int(m["slot"])), m["wire"] or "")
        if version == "11":
            bitfield, blank = bool(m["bits"]), bool(m["blank"])
            last = int(m["last"]) if m["last"] else 7
            slots = count if bitfield else min(count, last + 1 - int(m["slot"]))
    for place in (*(dataref.place for dataref in datarefs), *rows.values()):
        if place.wire and place.wire not in wires:
            raise MessageError(f"{where}: unit {place.wire}: expected one of {', '.join(wires)} ([wire units] above)")
    if (kind == "computed") == bool(datarefs or rows):
        raise MessageError(f"{where}: {cells[0]}: a computed field has no dataref and no row, every other has one")
    return Source(where, names, kind, bit, count, unit, datarefs, rows, slots, bitfield, blank, cells[4])


def _what(cell: str, validity: str, where: str, message: Definition) -> Tuple[Tuple[str, ...], str, str, int, str]:
    kind, _, bit = validity.partition(" ")
    if kind not in ("input", "computed", "engines", "engine"):
        kind, bit = "received", "" if validity == "-" else validity
    if kind == "computed":
        names = tuple(name.strip() for name in cell.split(","))
        units = [message.field(name, where).unit for name in names]
        return names, kind, bit, 1, units[0] if len(set(units)) == 1 else ", ".join(units)
    match = _FIELD.match(cell)
    if not match:
        raise MessageError(f"{where}: expected a name, a name[number] or a name [unit]: {cell}")
    name, count = match["name"], int(match["count"] or 0)
    if kind == "input" and match["unit"]:
        return (name,), kind, bit, count or 1, match["unit"]
    field = message.field(name, where)
    elements = 3 if field.type == "geometry_msgs/Vector3" else field.size or 1
    return (name,), kind, bit, count or elements, field.unit


def _datarefs(cell: str, where: str) -> List[Dataref]:
    """Those of the cell, each until the next one's version."""
    found: List[Tuple[int, Optional[Place]]] = []
    for part in filter(None, (part.strip() for part in cell.split("; "))):
        version = _FROM.match(part)
        first, text = (_number(version["version"]), version["rest"]) if version else (0, part)
        match = None if text == "-" else _DATAREF.match(text)
        if (match is None and text != "-") or (found and first <= found[-1][0]):
            raise MessageError(
                f"{where}: expected datarefs in the order of their versions, each with its wire unit in brackets or "
                f"`-` for none: {part}"
            )
        found.append((first, Place((match["path"],), match["wire"] or "") if match else None))
    ends = [first for first, _ in found[1:]] + [None]
    datarefs = [Dataref(place, first, end) for (first, place), end in zip(found, ends) if place]
    if len(datarefs) > MOST_DATAREFS:
        raise MessageError(f"{where}: expected at most {MOST_DATAREFS} datarefs of different versions")
    return datarefs


def _number(version: str) -> int:
    """12.08 as X-Plane numbers it: 120800."""
    major, _, minor = version.partition(".")
    return int(major) * 10000 + int(minor or 0) * 100


def _places(cell: str, form: "re.Pattern[str]", where: str) -> List[Tuple[str, "re.Match[str]"]]:
    found = []
    for part in filter(None, (part.strip() for part in cell.split("; "))):
        version, text = ("12", part[4:]) if part.startswith("12: ") else ("11", part)
        match = form.match(text)
        if not match:
            raise MessageError(f"{where}: no row.slot, with its wire unit in brackets: {part}")
        found.append((version, match))
    return found


def _checked(section: Section) -> Section:
    """The section with its bits, once every field of its message has one line and every bit a field."""
    message, sources = section.message, section.sources
    bits = message.bits("VALID_")
    if any(source.kind == "engine" for source in sources):
        arrays = [source.names[0] for source in sources if source.kind == "engine"]
        bits = [Constant(name.upper(), 1 << k, "") for k, name in enumerate(arrays)]
        every = next(c.value for c in message.constants if c.name == "VALID_ALL")
        if every != (1 << len(arrays)) - 1:
            raise MessageError(f"{message.name}: VALID_ALL is {every}, expected {(1 << len(arrays)) - 1}")
        sources = [s._replace(bit=s.names[0].upper()) if s.kind == "engine" else s for s in sources]
    names = [name for source in sources if source.kind != "input" for name in source.names]
    known = set(names) | ({"header", "valid"} if message.name == "FlightState" else set(HEADER))
    for name in message.fields:
        if name not in known:
            raise MessageError(f"{message.name}: {name} has no line in {SOURCES}: write it below [{message.name}: ...]")
    for name in names:
        if names.count(name) > 1:
            raise MessageError(f"{SOURCES}: {message.name}.{name} has {names.count(name)} lines, expected one")
    used = {source.bit for source in sources}
    for bit in used - {bit.name for bit in bits} - {""}:
        raise MessageError(f"{SOURCES}: {message.name} has no bit VALID_{bit}")
    for bit in bits:
        if bit.name not in used:
            raise MessageError(f"{message.name}: no field counts for VALID_{bit.name} in {SOURCES}")
    return section._replace(sources=sources, bits=bits)
