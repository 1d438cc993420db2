"""xplane_eye's token file, as the editors and shells of Windows write it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List

import pytest

from xplane_bridge.cli.sight import xplane_eye

TOKEN = "der Schlüssel"


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> List[str]:
    """The tokens of the programs that were started."""
    tokens: List[str] = []

    class Started:
        findings = None

        def __init__(self, options: Any, _say: Any) -> None:
            tokens.append(options.token)

        def run(self) -> None:
            pass

    monkeypatch.setattr(xplane_eye, "Eye", Started)
    return tokens


def start(file: Path) -> int:
    return xplane_eye.main(["127.0.0.1:49790", "--token-file", str(file)])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be"])
def test_the_token_is_the_text_of_the_file_whatever_wrote_it(tmp_path: Path, sent: List[str], encoding: str) -> None:
    file = tmp_path / "token.txt"
    mark = "\ufeff" if encoding == "utf-16-be" else ""
    file.write_bytes(f"{mark}{TOKEN}\r\n".encode(encoding))
    assert start(file) == 0
    assert sent == [TOKEN]


@pytest.mark.parametrize(
    ("raw", "problem"),
    [
        (None, "No such file or directory"),
        (TOKEN.encode("cp1252"), "it is no text in UTF-8 or UTF-16"),
        ("\ufeffkey".encode("utf-16-le")[:-1], "it is no text in UTF-8 or UTF-16"),
        (b"long" * 129, "its text is longer than 512 bytes"),
    ],
)
def test_a_file_without_such_a_text_is_one_line(
    tmp_path: Path, sent: List[str], capsys: pytest.CaptureFixture[str], raw: Any, problem: str
) -> None:
    file = tmp_path / "token.txt"
    if raw is not None:
        file.write_bytes(raw)
    assert start(file) == 1
    said = capsys.readouterr().err
    assert f"{file}: {problem}; --token-file takes a text file that holds capture_node's sender/token\n" in said
    assert said.count("\n") == 1
    assert sent == []
