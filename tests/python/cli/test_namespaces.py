"""A namespace as users write it: with and without slashes it is the same one, for every program."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import xplane_bridge.cli
from xplane_bridge.cli import record_watch
from xplane_bridge.topics import absolute

CLI = Path(xplane_bridge.cli.__file__).parent


@pytest.mark.parametrize(
    ("given", "meant"),
    [("lab", "/lab"), ("/lab", "/lab"), ("lab/", "/lab"), ("//lab", "/lab"), ("lab/first", "/lab/first"), ("/", "/")],
)
def test_slashes_around_a_namespace_do_not_matter(given: str, meant: str) -> None:
    assert absolute(given) == meant


def test_every_program_takes_a_namespace_so() -> None:
    found = {}
    for file in CLI.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            options = [getattr(each, "value", "") for each in node.args] if isinstance(node, ast.Call) else []
            if options in (["--namespace"], ["--mavros"]):
                kinds = [getattr(each.value, "id", "") for each in node.keywords if each.arg == "type"]
                found[file.stem, options[0]] = kinds
    assert len(found) >= 12
    assert {name for name, kind in found.items() if kind != ["absolute"]} == set()


def test_a_namespace_without_a_slash_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(record_watch, "start_node", lambda *_args, **_options: None)
    monkeypatch.setattr(record_watch.lockstep, "is_on", lambda namespace: namespace == "/lab")
    assert record_watch.main(["--namespace", "lab"]) == 0
