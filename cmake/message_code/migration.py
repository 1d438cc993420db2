"""What reads recordings of earlier versions: ROS's migration rules, and the fields that came later for our own readers.

migration/VERSION.txt holds the messages of a released version as a bag of it defines them. A message whose definition
has changed since gets a rule from there to today's: every old field keeps its value, and a later one is not a number,
0, false or empty.
"""

from pathlib import Path
from typing import Dict, List, Tuple

from definitions import ROOT, Definition, Field, MessageError, definition, read_lines

PACKAGE = "xplane_bridge"
FOLDER = "migration"

_SEPARATOR = "=" * 80
_FLOATS = ("float32", "float64")
_PRIMITIVES = (*_FLOATS, "bool", "string", "time", "duration", *(f"{u}int{b}" for u in "u " for b in (8, 16, 32, 64)))
PRIMITIVES = frozenset(name.strip() for name in _PRIMITIVES)
#: Messages of other packages that only later fields have.
LATER_TYPES = {"geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"}

Messages = Dict[str, Tuple[str, Definition]]  #: (text without comments, what it says) by package/Name


def _old_messages(path: Path) -> Messages:
    """Those of a released version, with those of other packages that they hold."""
    found: Messages = {}
    lines = path.read_text(encoding="utf-8").splitlines()
    for part in "\n".join(line for line in lines if not line.startswith("#")).split(f"{_SEPARATOR}\n"):
        head, _, text = part.partition("\n")
        if not head.startswith("MSG: "):
            raise MessageError(f"{path.name}: expected `MSG: package/Name` below each line of =: {head}")
        name = head[len("MSG: ") :].strip()
        found[name] = (text.strip("\n"), read_lines(name.split("/")[1], text, f"{path.name}, {name}"))
    return found


def _today(old: Messages, root: Path) -> Messages:
    """Today's of the messages that `old` has; those of other packages do not change, and LATER_TYPES come to them."""
    found = dict(old)
    for name, text in LATER_TYPES.items():
        found.setdefault(name, (text, read_lines(name.split("/")[1], text, name)))
    for name in old:
        package, short = name.split("/")
        if package == PACKAGE:
            if not (root / "msg" / f"{short}.msg").is_file():
                raise MessageError(f"msg/{short}.msg is gone, but recordings have it: see {FOLDER}/")
            text = (root / "msg" / f"{short}.msg").read_text(encoding="utf-8")
            code = (" ".join(line.split("#")[0].split()) for line in text.splitlines())
            found[name] = ("\n".join(filter(None, code)), definition(short, root))
    return found


def _full_name(kind: str, messages: Messages) -> str:
    """package/Name of a field's type; empty: a primitive."""
    if kind in PRIMITIVES:
        return ""
    names = (kind, f"{PACKAGE}/{kind}", f"std_msgs/{kind}")
    return next(name for name in names if name in messages and "/" in name)


def _needed(name: str, messages: Messages, found: List[str]) -> List[str]:
    """The message and all that it holds, each once."""
    if name not in found:
        found.append(name)
        for field in messages[name][1].fields.values():
            inner = _full_name(field.type, messages)
            if inner:
                _needed(inner, messages, found)
    return found


def _full_text(name: str, messages: Messages) -> str:
    """As ROS writes it into a bag."""
    first, *others = _needed(name, messages, [])
    return f"\n{_SEPARATOR}\n".join([messages[first][0], *(f"MSG: {n}\n{messages[n][0]}" for n in others)])


def _leaves(field: Field, messages: Messages) -> List[Tuple[str, Field]]:
    """The numbers and texts that a field consists of, each with its path; the field itself where it is one.

    Raises:
        MessageError: It is an array of messages.
    """
    inner = _full_name(field.type, messages)
    if not inner:
        return [(field.name, field)]
    if field.is_list or field.size:
        raise MessageError(f"{field.name}: a later field that is an array of messages has no value in old recordings")
    parts = messages[inner][1].fields.values()
    return [(f"{field.name}.{path}", leaf) for part in parts for path, leaf in _leaves(part, messages)]


def _default(field: Field) -> str:
    """Python for what a field holds that was not recorded."""
    one = "float('nan')" if field.type in _FLOATS else {"bool": "False", "string": "''"}.get(field.type, "0")
    if field.is_list:
        return "[]"
    return f"[{one}] * {field.size}" if field.size else one


def later(old: Definition, new: Definition) -> List[Field]:
    """Fields that came after `old`, which are the last ones.

    Raises:
        MessageError: An old field has changed its name, type or place.
    """
    before, today = list(old.fields.values()), list(new.fields.values())
    for was, is_now in zip(before, [*today, *[None] * len(before)]):
        own = None if is_now is None else (is_now.name, _bare(is_now.type), is_now.size)
        if own != (was.name, _bare(was.type), was.size):
            raise MessageError(
                f"{new.name}: recordings have {was.type} {was.name} where {own[0] if own else 'nothing'} is now: "
                "write new fields at the end"
            )
    return today[len(before) :]


def _bare(kind: str) -> str:
    return kind.rsplit("/", 1)[-1]


def _update(name: str, old: Messages, new: Messages) -> Tuple[str, str]:
    """The pairs of migrated types, and the body of `update`."""
    pairs, body = [], []
    for field in old[name][1].fields.values():
        inner = _full_name(field.type, old)
        if not inner:
            body.append(f"new_msg.{field.name} = old_msg.{field.name}")
            continue
        shown = "Header" if inner == "std_msgs/Header" else inner.replace(f"{PACKAGE}/", "")
        if (shown, shown) not in pairs:
            pairs.append((shown, shown))
        if field.is_list or field.size:
            body.append(f"self.migrate_array(old_msg.{field.name}, new_msg.{field.name}, '{shown}')")
        else:
            body.append(f"self.migrate(old_msg.{field.name}, new_msg.{field.name})")
    for field in later(old[name][1], new[name][1]):
        body.extend(f"new_msg.{path} = {_default(leaf)}" for path, leaf in _leaves(field, new))
    return repr(pairs), "\n".join(f"        {line}" for line in body)


def _rule(version: str, name: str, old: Messages, new: Messages) -> str:
    pairs, body = _update(name, old, new)
    short = name.split("/")[1]
    return (
        f"class {short}From{version.replace('.', '_')}(MessageUpdateRule):\n"
        f'    old_type = "{name}"\n    old_full_text = """\n{_full_text(name, old)}\n"""\n\n'
        f'    new_type = "{name}"\n    new_full_text = """\n{_full_text(name, new)}\n"""\n\n'
        f"    order = 0\n    migrated_types = {pairs}\n    valid = True\n\n"
        f"    def update(self, old_msg, new_msg):\n{body}\n"
    )


def rules(root: Path = ROOT) -> Dict[str, str]:
    """Every file of migration rules by name: one for each released version."""
    files = {}
    for path in sorted((root / FOLDER).glob("*.txt")):
        old = _old_messages(path)
        new = _today(old, root)
        changed = [n for n in old if n.startswith(PACKAGE) and _full_text(n, old) != _full_text(n, new)]
        head = (
            f"# From recordings of version {path.stem} to today's messages, for `rosbag check` and `rosbag fix`.\n"
            f"# Made from {FOLDER}/{path.name} and msg/ by cmake/message_code "
            "(`python3 cmake/message_code migration`); not to be edited.\n\n\n"
        )
        files[f"{path.stem}.bmr"] = head + "\n\n".join(_rule(path.stem, name, old, new) for name in changed)
    return files


def _shape(field: Field) -> str:
    return f'("{field.type}", {-1 if field.is_list else field.size or 0}, "{field.unit}")'


def later_fields(root: Path = ROOT) -> str:
    """The text of src/xplane_bridge/bags/later_fields.py."""
    rows: Dict[str, Dict[str, str]] = {}
    for path in sorted((root / FOLDER).glob("*.txt")):
        old = _old_messages(path)
        new = _today(old, root)
        for name in old:
            for field in later(old[name][1], new[name][1]):
                for path, leaf in _leaves(field, new):
                    rows.setdefault(name, {})[path] = _shape(leaf)
    body = "".join(
        f'    "{name}": {{\n' + "".join(f'        "{field}": {what},\n' for field, what in fields.items()) + "    },\n"
        for name, fields in sorted(rows.items())
    )
    return (
        '"""Fields that messages have got since version 0.1.0, for bags that were recorded before.\n\n'
        f"Made from {FOLDER}/ and msg/ by cmake/message_code "
        "(`python3 cmake/message_code migration`); not to be edited.\n"
        '"""\n\nfrom __future__ import annotations\n\nfrom typing import Dict, Tuple\n\n'
        "#: (type, elements; 0: a scalar, -1: a list; unit) by field, by message.\n"
        f"LATER_FIELDS: Dict[str, Dict[str, Tuple[str, int, str]]] = {{\n{body}}}\n"
    )


def write(root: Path = ROOT) -> None:
    """Writes them all."""
    for name, text in rules(root).items():
        (root / FOLDER / name).write_text(text, encoding="utf-8")
    target = root / "src" / PACKAGE / "bags" / "later_fields.py"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(later_fields(root), encoding="utf-8")
