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


#: Words that leave open which program or person acts, and "tell" where something is published, reported or shown. Also
#: as parts of names; a file's tell() is none of ours.
VAGUE = re.compile(
    r"(?i:some|any|every|no)body|\b(?i:someone|anyone|everyone|the books)\b|\b[Ww]hom(?:ever)?\b|(?i:whoever)"
    r"|(?<![A-Za-z.])(?:[Tt]ells?|[Tt]old)(?![A-Za-z])|(?<=[a-z])(?:Tells?|Told)(?![a-z])"
)
WRITTEN = {".hpp", ".cpp", ".py", ".cmake", ".md", ".rst", ".yaml", ".launch", ".msg", ".srv", ".xml", ".toml", ""}
FOLDERS = ("include", "lib", "src", "cmake", "config", "docs", "launch", "msg", "srv", "scripts", "tests")


def vague_words(text):
    """Line number and word of each."""
    return [(text.count("\n", 0, match.start()) + 1, match.group()) for match in VAGUE.finditer(text)]


def newest_section(changelog):
    """The file before the heading of its second section: history stays as it was written."""
    headings = [match.start() for match in re.finditer(r"^\S.*\n-{3,}$", changelog, re.MULTILINE)]
    return changelog[: [*headings, len(changelog)][1]]


def test_vague_words_are_found():
    text = "// Somebody reads.\nbool anybodyListens();\nTEST(Log, ResetIsTold)\ntest_it_is_told\nnot told\n"
    assert [line for line, _ in vague_words(text)] == [1, 2, 3, 4, 5]
    assert vague_words("size = file.tell()\ntest_intellisense\nno body is rigid, anyone's\n") == [(3, "anyone")]
    sections = "Title\n^^^^^\nForthcoming\n-----------\n* new\n0.1.0 (date)\n------------\n* somebody\n"
    assert newest_section(sections) == "Title\n^^^^^\nForthcoming\n-----------\n* new\n"


def test_texts_name_who_acts():
    files = [path for folder in FOLDERS for path in sources(f"{folder}/**/*") if path.suffix in WRITTEN]
    files = [path for path in [*files, *sources("*.md", "*.rst")] if path.is_file() and path.name != "test_dialect.py"]
    assert len(files) > 800
    found = []
    for path in files:
        text = path.read_text(encoding="utf-8")
        for line, word in vague_words(newest_section(text) if path.name == "CHANGELOG.rst" else text):
            found.append(f"{path.relative_to(ROOT)}:{line}: {word}: name the actor; or reports, publishes, shows")
    assert found == []
