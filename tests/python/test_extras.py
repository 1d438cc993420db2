"""pip's extras: each lists what the programs behind it import, and only what the requirements files list too."""

from __future__ import annotations

import ast
import importlib.util
import re
from pathlib import Path

import pytest

from support.room_table import ROOT

SOURCE = ROOT / "src"
#: Where the package's name is not what is imported.
IMPORTED_AS = {"opencv-python-headless": "cv2", "PyYAML": "yaml"}
#: ROS and what the build makes: from no package index.
ROS = re.compile(r"(rospy|rosgraph|rosservice|roslib|\w+_msgs)$")
EMULATOR = (
    "cli.xplane_emulator",
    *(f"emulator.aircraft.{name}.{name}" for name in ("fixed_wing", "multirotor", "tiltrotor")),
    "emulator.view.renderer.__main__",
)
#: Extra to the modules where its programs begin, what they import and can do without, and what nothing here imports.
EXTRAS = {
    "emulator": (EMULATOR, set(), set()),
    "report": (("cli.flight_report",), set(), set()),
    # bag_export says itself how to get dask.distributed (--scheduler).
    "export": (("cli.bag_export",), {"distributed"}, set()),
    "joystick": (("cli.joy_reader", "cli.joy_config_check"), set(), set()),
}  # fmt: skip


def file_of(module: str) -> Path | None:
    """The source of a module of the package; None for others, and for what only looks like one."""
    path = SOURCE.joinpath(*module.split("."))
    candidates = (path.with_name(path.name + ".py"), path / "__init__.py")
    return next((c for c in candidates if module.startswith("xplane_bridge") and c.is_file()), None)


def imports(path: Path) -> set[str]:
    """Full names of what a source imports anywhere in it, but for types alone."""
    inside = path.relative_to(SOURCE).with_suffix("").parts[:-1]
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = [*inside[: len(inside) - node.level + 1]] if node.level else []
            name = ".".join([*base, *([node.module] if node.module else [])])
            found.add(name)
            found.update(f"{name}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "import_module":
            found.update(arg.value for arg in node.args if isinstance(arg, ast.Constant))
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(path.read_text(encoding="utf-8")))
    return found


def is_standard(name: str) -> bool:
    """Whether a package comes with Python."""
    spec = importlib.util.find_spec(name)
    if spec is None:
        return False
    return spec.origin is not None and not {"site-packages", "dist-packages"} & set(Path(spec.origin).parts)


def third_party(start: tuple[str, ...]) -> set[str]:
    """Packages of others that these modules import, by way of all modules of the package that they import."""
    todo, seen, out = [f"xplane_bridge.{name}" for name in start], set(), set()
    for name in todo:
        assert file_of(name) is not None, name
    while todo:
        module = todo.pop()
        if module in seen:
            continue
        seen.add(module)
        path = file_of(module)
        if path is None:
            continue
        todo += [".".join(module.split(".")[:i]) for i in range(1, module.count(".") + 1)]
        for name in imports(path):
            if name.split(".")[0] == "xplane_bridge":
                todo.append(name)
            elif not is_standard(name.split(".")[0]) and not ROS.match(name.split(".")[0]):
                out.add(name.split(".")[0])
    return out


def requirements(file: str) -> list[str]:
    """The lines of a requirements file."""
    return [line for line in (ROOT / file).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]


def listed(extra: str) -> list[str]:
    """What pyproject.toml lists for an extra."""
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    return ast.literal_eval(re.search(rf"^{extra} = (\[.*?\])$", project, re.MULTILINE | re.DOTALL).group(1))


@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_lists_what_its_programs_import_and_nothing_else(extra):
    start, can_do_without, not_imported = EXTRAS[extra]
    names = {re.match(r"[\w-]+", line).group(0) for line in listed(extra)}
    assert {IMPORTED_AS.get(name, name) for name in names - not_imported} == third_party(start) - can_do_without
    assert not_imported <= names
    assert set(listed(extra)) <= {*requirements("requirements.txt"), *requirements("requirements-dev.txt")}


def test_the_search_finds_imports_of_every_form(tmp_path, monkeypatch):
    room = tmp_path / "xplane_bridge" / "room"
    room.mkdir(parents=True)
    (room / "__init__.py").write_text("", encoding="utf-8")
    (room / "a.py").write_text("from . import b\nif TYPE_CHECKING:\n    import quiet\nimport os", encoding="utf-8")
    late = ("import one.part", "importlib.import_module('two')", "from three import x", "import rospy")
    (room / "b.py").write_text("def f():\n    " + "\n    ".join(late), encoding="utf-8")
    monkeypatch.setitem(globals(), "SOURCE", tmp_path)
    assert third_party(("room.a",)) == {"one", "two", "three"}
