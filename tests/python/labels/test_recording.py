"""Which recording labels are of: flights in lock-step have the same stamps, and are two recordings all the same."""

from __future__ import annotations

import json
import logging
from typing import TYPE_CHECKING, Any, Callable, Dict

import pytest

from support.flights.drawn_approach import write_approach
from support.flights.synthetic_flight import FlightBag
from support.white_lines import airport_file
from xplane_bridge.bags import Bags
from xplane_bridge.cli.sight import label_images
from xplane_bridge.labels import table
from xplane_bridge.labels.recording import identity, labels_of

if TYPE_CHECKING:
    from pathlib import Path

PICTURES = 3


@pytest.fixture(name="flight")
def fixture_flight(tmp_path: Path) -> Path:
    """A bag with its labels beside it."""
    path = write_approach(tmp_path / "flight.bag", PICTURES)
    assert label_images.main([str(path), "--apt", str(airport_file()), "--airport", "XEMU", "--flat-world"]) == 0
    return path


def identity_of(*paths: Path) -> str:
    with Bags(paths) as bags:
        return identity(bags)


def read(bag: Path, labels: Path) -> table.Labels:
    with Bags(bag) as bags:
        return labels_of(bags, labels)


def as_earlier(labels: Path, change: Callable[[Dict[str, Any]], object] = lambda _: None) -> Path:
    """The file as versions wrote it that did not note the recording, each picture's line changed."""
    about, *frames = map(json.loads, labels.read_text().splitlines())
    del about["recording"]
    for frame in frames:
        change(frame)
    path = labels.with_name("earlier.labels.jsonl")
    path.write_text("".join(f"{json.dumps(line)}\n" for line in (about, *frames)))
    return path


def crossing(number: float) -> Callable[[float], Any]:
    return lambda t: [(37.46, 126.44, number + t, 0.0, 0.0, 0.0)]


def test_the_identity_is_that_of_what_labels_are_made_from(flight: Path, tmp_path: Path) -> None:
    known = identity_of(flight)
    parts = [tmp_path / f"part_{k}.bag" for k in range(2)]
    with Bags(flight) as bags:
        messages = list(bags.recorded())
    for part, path in enumerate(parts):
        with FlightBag(path) as bag:
            for k, (topic, time, raw) in enumerate(messages):
                if (k >= len(messages) // 2) == part:
                    bag.add_recorded(topic, time, raw)
    assert identity_of(*parts) == identity_of(*parts[::-1]) == known
    assert identity_of(parts[0]) != known
    nearer = write_approach(tmp_path / "nearer.bag", PICTURES, far=899.9)
    assert identity_of(nearer) != known
    # Of a flight that differs in nothing but another aircraft, too.
    low, high = (write_approach(tmp_path / f"{k}.bag", PICTURES, traffic=crossing(k)) for k in (100.0, 200.0))
    assert len({identity_of(path) for path in (low, high, flight)}) == 3


def test_a_recording_without_anything_to_label_has_one_too(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "a.bag") as bag:
        bag.add("/xplane/flight_state", "xplane_bridge/FlightState", 1, bag.state(0.0, 0))
    assert int(identity_of(tmp_path / "a.bag"), 16) == 0


def test_labels_of_another_flight_with_the_same_stamps_are_refused(flight: Path, tmp_path: Path) -> None:
    labels = table.beside(flight)
    assert read(flight, labels) == table.read(labels)
    other = write_approach(tmp_path / "other.bag", PICTURES, far=300.0)
    said = f"^{labels}: labels of another recording, made from flight.bag; expected those of {other}, but "
    with pytest.raises(table.LabelError, match=said):
        read(other, labels)


def test_labels_of_earlier_versions_are_taken_with_a_warning(flight: Path, caplog: pytest.LogCaptureFixture) -> None:
    labels = as_earlier(table.beside(flight), lambda frame: frame.pop("quality"))
    with caplog.at_level(logging.WARNING):
        found = read(flight, labels)
    assert found.about["recording"] == identity_of(flight)
    assert len(found.frames) == PICTURES
    assert (
        f"{labels}: written by a version that did not note the recording; taken for labels of {flight}" in caplog.text
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"stamp_ns": 5}, "but these have no picture of camera camera with stamp 5 ns; label_images writes them anew"),
        ({"camera": "belly"}, "but these have no picture of camera belly with stamp "),
        ({"quality": 64}, " has quality 0 in these, and 64 there; label_images writes them anew"),
    ],
)
def test_labels_of_earlier_versions_that_contradict_the_recording_are_refused(
    flight: Path, change: Dict[str, Any], said: str
) -> None:
    labels = as_earlier(table.beside(flight), lambda frame: frame.update(change))
    with pytest.raises(table.LabelError, match=said):
        read(flight, labels)
