"""What comes of a card: lines, the file that the nodes read, and a report for people."""

from __future__ import annotations

import json
import platform
import time
from pathlib import Path
from typing import Any, Dict

from xplane_bridge.doctor.conformance.card import Flown
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.questions import CARD
from xplane_bridge.doctor.conformance.verdict import Answer, Verdict
from xplane_bridge.doctor.observe.computer import is_same_computer

_FORMAT = "xplane_bridge conformance"
_VERSION = 1
_HERE = "127.0.0.1"


def line(question: Question, answer: Answer) -> str:
    """One line of stdout."""
    return f"{question.id}: {answer.verdict.value} ({' '.join(answer.text.split())})"


def file_of(folder: Path, address: str, port: int) -> Path:
    """Where the nodes look for it: for an X-Plane on this computer, whichever address it is called by, in one file."""
    return _named(folder, _HERE if is_same_computer(address, _HERE) else address, port)


def store(file: Path, flown: Flown, address: str, port: int) -> Path:
    """Writes the file, and the report beside it; what was settled before for the same version of X-Plane stays.

    A question that cannot be tested this time is no answer to it: the earlier verdict stays, with the reason beside it.

    Returns:
        The report.
    """
    questions: Dict[str, Any] = {}
    # Earlier versions named the file by the address that was flown, also on this computer.
    for earlier in sorted((_named(file.parent, address, port), file), key=_written):
        questions.update(_earlier(earlier, flown.version))
    for id_, answer in flown.answers.items():
        settled = questions.get(id_, {}).get("verdict") in (Verdict.CONFIRMED.value, Verdict.REFUTED.value)
        if settled and answer.verdict is Verdict.NOT_TESTABLE:
            questions[id_]["later_not_testable"] = answer.text
        else:
            questions[id_] = {"verdict": answer.verdict.value, "text": answer.text, "facts": answer.facts}
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        "xplane_version": flown.version,
        "host": address,
        "port": port,
        "flown": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "questions": questions,
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    new = file.with_name(file.name + ".new")
    # JSON is YAML, and needs no package to be written.
    new.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    new.replace(file)
    report = file.with_name(file.stem + "_report.txt")
    report.write_text(_report(content), encoding="utf-8")
    return report


def _named(folder: Path, address: str, port: int) -> Path:
    return folder / f"{address}_{port}_conformance.yaml"


def _written(file: Path) -> float:
    """When [s]; 0: it is not there."""
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


def _earlier(file: Path, version: int) -> Dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        same = content["format"] == _FORMAT and content["xplane_version"] == version
        return dict(content["questions"]) if same else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _report(content: Dict[str, Any]) -> str:
    assumptions = {question.id: question.assumes for question in CARD}
    lines = [
        "xplane_bridge conformance report",
        f"X-Plane {content['xplane_version']} at {content['host']}:{content['port']}, flown {content['flown']}",
        f"doctor on {platform.platform()}, Python {platform.python_version()}",
        "",
    ]
    for id_, said in content["questions"].items():
        lines += [
            f"{id_}: {said['verdict']}",
            f"  assumed: {assumptions.get(id_, '-')}",
            f"  seen: {said['text']}",
            f"  numbers: {json.dumps(said['facts'])}",
        ]
        if "later_not_testable" in said:
            lines.append(f"  later not testable: {said['later_not_testable']}")
    return "\n".join(lines) + "\n"
