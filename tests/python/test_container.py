"""The Containerfile can be carried out: its steps, and what stays out of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from container import container_steps

ROOT = Path(__file__).resolve().parents[2]


def test_the_shipped_file_has_known_steps_only_and_sets_up_as_the_readme_does():
    steps = container_steps.steps((ROOT / "Containerfile").read_text(encoding="utf-8"))
    assert steps[0] == container_steps.Step("FROM", "debian:12")
    assert container_steps.Step("RUN", "scripts/setup") in steps


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("FROM debian:12\nADD x /y\n", "ADD x /y: this program does not know ADD"),
        ("FROM ubuntu:20.04\n", "FROM ubuntu:20.04: this program makes debian:12 only"),
        ("FROM debian:12\nCOPY src /y\n", "copies the whole folder only"),
        ("RUN true\n", "the first step is not FROM"),
        ("", "the first step is not FROM"),
    ],
)
def test_other_steps_are_refused_in_words(text, words):
    with pytest.raises(ValueError, match=words.replace("(", r"\(")):
        container_steps.steps(text)


def test_a_step_may_go_over_several_lines():
    assert container_steps.steps("# text\nFROM debian:12\nRUN a && \\\n  b\n")[1].words == "a &&    b"


def test_what_is_made_in_a_clone_stays_out_of_the_image(tmp_path):
    for name in (".git", ".venv", ".workspace", "docs/build"):
        (tmp_path / "clone" / name).mkdir(parents=True)
    patterns = container_steps.ignored((ROOT / ".containerignore").read_text(encoding="utf-8"))
    root = container_steps.BareRoot(tmp_path / "root", [])
    root.carry_out(container_steps.Step("COPY", ". /opt/x"), tmp_path / "clone", patterns)
    assert sorted(path.name for path in (tmp_path / "root/opt/x").iterdir()) == ["docs"]
    assert (tmp_path / "root/opt/x/docs/build").is_dir()  # what is left out is at the top only


def test_a_root_that_is_not_empty_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit):
        container_steps.main([str(tmp_path)])
    assert "is not empty: give the folder of a new root" in capsys.readouterr().err
