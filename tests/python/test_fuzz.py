"""The fuzzing of what reads files and packets: it runs, and finds what it is for."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest

from support.room_table import ROOT

PROGRAM = ROOT / "tests/fuzz/fuzz_python.py"


def load():
    spec = importlib.util.spec_from_file_location("fuzz_python", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_each_reader_refuses_changed_input_by_its_own_error():
    done = subprocess.run([sys.executable, PROGRAM, "--runs", "40"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "".join(f"{name}: 40 inputs\n" for name in load().TARGETS)


def test_a_reader_that_breaks_is_found_with_its_input_and_again(monkeypatch):
    module = load()

    def take(data):
        if len(data) > 40 and data[5] > 200:
            raise IndexError("planted")

    monkeypatch.setitem(module.TARGETS, "codec", module.TARGETS["codec"]._replace(take=take))
    texts = []
    for _ in range(2):
        with pytest.raises(AssertionError, match=r"(?s)codec, seed 1, run .*planted") as found:
            module.fuzz("codec", 1, 5000, float("inf"))
        texts.append(str(found.value))
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(["--runs", "1", "mixing"], "no target mixing; there are: codec,"), ([], "give --runs or --seconds")],
)
def test_a_wrong_command_line_is_refused(arguments, said):
    done = subprocess.run([sys.executable, PROGRAM, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert said in done.stderr
