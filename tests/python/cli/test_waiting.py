"""What programs say while they wait for a bridge, from what the ROS master knows."""

from __future__ import annotations

import pytest

from xplane_bridge.cli.bridge import waiting
from xplane_bridge.cli.bridge.waiting import Patience, Surroundings, about_joy, about_service, about_topic

STATE = "xplane_bridge/FlightState"
THERE = Surroundings(
    publishers={"/lab/flight_state": ["/lab/rx_node"], "/old/flight_state": [], "/xplane/odom": ["/xplane/rx_node"]},
    types={"/lab/flight_state": STATE, "/old/flight_state": STATE, "/xplane/odom": "nav_msgs/Odometry"},
    services=["/lab/tx_node/set_mode", "/lab/tx_node/set_wind", "/rosout/get_loggers"],
)


def test_a_topic_in_another_namespace_is_offered() -> None:
    assert about_topic("/xplane/flight_state", STATE, THERE) == (
        f"no node publishes /xplane/flight_state ({STATE}); topics of that type: /lab/flight_state "
        "(choose with --namespace)"
    )


def test_without_any_bridge_the_launch_file_is_named() -> None:
    text = about_topic("/xplane/link_state", "xplane_bridge/LinkState", THERE)
    assert "no other topic of that type: start the bridge (roslaunch xplane_bridge bridge.launch)" in text


def test_a_silent_publisher_is_named_with_what_its_link_says() -> None:
    text = about_topic("/lab/flight_state", STATE, THERE, "searching, no answer from 10.0.0.7:49000")
    assert text == (
        f"nothing on /lab/flight_state ({STATE}), though /lab/rx_node would publish it; "
        "link to X-Plane: searching, no answer from 10.0.0.7:49000"
    )


@pytest.mark.parametrize(
    ("service", "there", "words"),
    [
        ("/xplane/tx_node/set_mode", THERE, "of that kind there is: /lab/tx_node/set_mode (choose with --namespace)"),
        ("/xplane/tx_node/reset_flight", THERE, "bridge.launch starts tx_node unless tx:=false"),
        ("/xplane/tx_node/set_mode", None, "the ROS master does not answer"),
    ],
)
def test_services_likewise(service: str, there: Surroundings, words: str) -> None:
    text = about_service(service, there)
    assert service in text
    assert words in text


@pytest.mark.parametrize(
    ("takers", "taken"),
    [(["/xplane/joystick_mapper_node"], True), (["/xplane/record", "/xplane/joystick_mapper_node"], True),
     (["/xplane/record"], False), ([], False)],
)  # fmt: skip
def test_a_joystick_that_only_a_recorder_hears_moves_nothing(takers: list[str], taken: bool) -> None:
    every = ["/xplane/record", "/xplane/joystick_mapper_node", "/player"]
    publishers = {"/rosout": every, "/xplane/control/manual": every[1:2], "/xplane/joy": every[2:]}
    text = about_joy("/xplane/joy", Surroundings(publishers, {}, [], {"/xplane/joy": takers}))
    assert (text == "") == taken
    assert taken or text.startswith("no node takes /xplane/joy: start joystick_mapper_node (roslaunch xplane_bridge")
    assert about_joy("/xplane/joy", None) == ""


def test_it_speaks_after_five_seconds_and_again_only_with_another_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    now, reasons, said = [100.0], ["a"], []
    monkeypatch.setattr(waiting.time, "monotonic", lambda: now[0])
    patience = Patience(lambda: reasons[-1], said.append)
    for now[0] in (100.0, 104.9):
        patience.look()
    assert said == []
    for now[0] in (105.0, 106.5, 200.0):
        patience.look()
    assert said == ["a"]
    reasons.append("b")
    now[0] = 200.5  # a second between two looks at the master
    patience.look()
    assert said == ["a"]
    now[0] = 201.5
    patience.look()
    assert said == ["a", "b"]
    patience.restart()
    reasons.append("c")
    now[0] = 206.0
    patience.look()
    assert said == ["a", "b"]
