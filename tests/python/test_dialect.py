"""What no tool checks of the dialect in CONTRIBUTING.md."""

from __future__ import annotations

import re

import pytest

from support.room_table import ROOT


def sources(*patterns):
    return sorted(path for pattern in patterns for path in ROOT.glob(pattern))


HEADERS = sources("include/**/*.hpp", "lib/**/*.hpp", "tests/**/*.hpp")
CPP = sources("include/**/*.hpp", "lib/**/*.[ch]pp", "src/*.cpp", "tests/**/*.[ch]pp", "docs/examples/**/*.[ch]pp")
PYTHON = sources("src/**/*.py", "cmake/**/*.py")


@pytest.mark.parametrize(
    ("files", "wrong", "right"),
    [
        (HEADERS, r"\A(?!#pragma once\n)", "a header begins with #pragma once"),
        (CPP, r"\bk[A-Z][A-Za-z0-9]*_(?:s|ns|ms|m|deg|hz)\b", "a constant has its unit in a comment"),
        (CPP, r"^TEST(?:_[FP])?\(\w+, [a-z]", "a test's name begins with a capital"),
        (PYTHON, r"\| None\b", "Optional[X]"),
        (PYTHON, r"\bexcept .* as (?!error\b|ended\b)\w+:", "as error"),
    ],
)
def test_a_rule_of_the_dialect_is_kept(files, wrong, right):
    assert len(files) > 20
    found = []
    for path in files:
        text = path.read_text(encoding="utf-8")
        for match in re.finditer(wrong, text, re.MULTILINE):
            found.append(f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}: {right}")
    assert found == []
