"""What the doctor makes of what it has observed: each check with planted evidence, and nothing else."""

from pathlib import Path

import pytest

from xplane_bridge.doctor import names
from xplane_bridge.doctor.checks import CHECKS, clock, data_output, joystick, leftovers, link, ros, simulator, window
from xplane_bridge.doctor.evidence import Evidence
from xplane_bridge.doctor.finding import Severity
from xplane_bridge.doctor.observe.beacons import BeaconWatch, Sighting
from xplane_bridge.doctor.observe.clock import ClockWatch
from xplane_bridge.doctor.observe.computer import Computer
from xplane_bridge.doctor.observe.data_output import DataWatch
from xplane_bridge.doctor.observe.journals import Entry, Journal, Owner
from xplane_bridge.doctor.observe.joysticks import Joystick, Joysticks
from xplane_bridge.doctor.observe.ports import Holder
from xplane_bridge.doctor.observe.ros import Node, RosFacts
from xplane_bridge.doctor.observe.simulator import Answers
from xplane_bridge.doctor.observe.target import Chosen, Target
from xplane_bridge.doctor.observe.windows import Display, Window
from xplane_bridge.doctor.settings import Settings

#: Of the block for documentation: no address of this computer.
FAR = "192.0.2.1"
JOYSTICK = "sim/operation/override/override_joystick"
FAR_TARGET = Target(FAR, FAR, 49000, Chosen.OPTION)
HERE = Target("127.0.0.1", "127.0.0.1", 49000, Chosen.OPTION)
LAB = Sighting(FAR, 49000, 115501, "lab-pc")


def answers(**kept):
    """Answers of a simulator that flies."""
    values = {names.VERSION: 115501.0, names.RUNNING_TIME: 11.0, names.PAUSED: 0.0, names.REPLAY: 0.0}
    first = {names.RUNNING_TIME: 10.0}
    return Answers({**values, **kept.pop("values", {})}, first, kept.pop("sources", {(FAR, 49000): 8}), **kept)


def only(findings, severity, id_, *words):
    """The one finding, which must be this one and say these words."""
    assert [(finding.severity, finding.id) for finding in findings] == [(severity, id_)]
    (finding,) = findings
    for word in words:
        assert word in f"{finding.text} -> {finding.remedy}"
    if severity in (Severity.WARNING, Severity.PROBLEM):
        assert finding.remedy, "what the user has to do is missing"
    return finding


PROBLEM, WARNING, NOTE, OK = Severity.PROBLEM, Severity.WARNING, Severity.NOTE, Severity.OK


def test_where_all_is_well_no_check_has_anything_to_do():
    evidence = Evidence(
        target=FAR_TARGET,
        beacons=BeaconWatch((LAB,), ("lo", "eth0")),
        answers=answers(),
        ros=RosFacts("http://localhost:11311", host="localhost", address="127.0.0.1", here=True, answered=True,
                     nodes=(Node("/xplane/rx_node", "http://localhost:4711"),)),
        joysticks=Joysticks((Joystick("/dev/input/js0", "Logitech Extreme 3D", True),)),
        clock=ClockWatch(0.0001, 6.0, True),
    )  # fmt: skip
    findings = [finding for check, _ in CHECKS for finding in check(evidence)]
    assert [finding for finding in findings if finding.severity.counts] == []
    assert {finding.id for finding in findings} >= {
        "beacon",
        "answer",
        "version",
        "master",
        "nodes",
        "joystick",
        "clock",
    }


# ---------------------------------------------------------------------------------------------------------- beacons


def test_a_beacon_is_reported_with_all_addresses_of_its_computer():
    twice = (LAB, Sighting("198.51.100.1", 49000, 115501, "lab-pc"))
    evidence = Evidence(beacons=BeaconWatch(twice), target=Target(chosen=Chosen.BEACON))
    only(link.beacons(evidence), OK, "beacon", "11.55 (115501)", "lab-pc", FAR, "198.51.100.1", "port 49000")
    assert link.several(evidence) == []


def test_without_a_beacon_what_answers_on_this_computer_is_not_found_by_the_nodes():
    evidence = Evidence(beacons=BeaconWatch(interfaces=("lo",)), answers=answers())
    only(link.beacons(evidence), WARNING, "no-beacon", "239.255.1.1:49707", "host:=127.0.0.1")
    given = Evidence(beacons=BeaconWatch(interfaces=("lo",)), answers=answers(), target=FAR_TARGET)
    only(link.beacons(given), NOTE, "no-beacon", "not needed")


@pytest.mark.parametrize(
    ("computer", "words"),
    [
        (Computer(wsl=True), "WSL2 gets no multicast"),
        (Computer(firewall="ufw"), "sudo ufw allow proto udp to any port 49707"),
        (Computer(), "routers"),
    ],
)
def test_why_no_beacon_comes_depends_on_the_system(computer, words):
    evidence = Evidence(beacons=BeaconWatch(interfaces=("eth0",)), computer=computer, target=FAR_TARGET)
    only(link.beacons(evidence), NOTE, "no-beacon", "eth0", words)


def test_a_beacon_port_that_another_program_keeps_to_itself():
    evidence = Evidence(beacons=BeaconWatch(error="Address already in use"), holders={49707: [Holder("fmc_app", 12)]})
    only(link.beacons(evidence), WARNING, "beacon-not-heard", "Address already in use", "end fmc_app (process 12)")


def test_displays_of_another_x_plane_and_odd_datagrams_are_noted():
    view = Sighting(FAR, 49000, 115501, "screen", flies=False)
    findings = link.beacons(Evidence(beacons=BeaconWatch((LAB, view), odd=3)))
    assert [finding.id for finding in findings] == ["beacon", "beacon-of-a-display", "odd-beacon"]
    assert not any(finding.severity.counts for finding in findings)


def test_several_x_planes_are_listed_and_one_has_to_be_named():
    watch = BeaconWatch((LAB, Sighting("192.0.2.2", 49010, 122015, "lab-mac")))
    chosen = Target(FAR, FAR, 49000, Chosen.BEACON)
    found = only(
        link.several(Evidence(beacons=watch, target=chosen)),
        PROBLEM, "several-simulators",
        "lab-pc (192.0.2.1) port 49000", "lab-mac (192.0.2.2) port 49010", "12.20", "host:=",
    )  # fmt: skip
    assert found.facts["simulators"][1] == {"address": "192.0.2.2", "port": 49010, "name": "lab-mac"}
    only(link.several(Evidence(beacons=watch, target=FAR_TARGET)), NOTE, "several-simulators", FAR)


# ---------------------------------------------------------------------------------------------------------- answers


@pytest.mark.parametrize(
    ("evidence", "id_", "words"),
    [
        (Evidence(target=Target("lab", "", 49000, Chosen.OPTION, "Name or service not known")),
         "unknown-host", ["lab", "Name or service not known", "/etc/hosts"]),
        (Evidence(target=HERE, holders={49000: [Holder("other_app", 9)]}),
         "port-taken", ["nothing answers on 127.0.0.1:49000", "other_app (process 9)", "port:="]),
        (Evidence(target=FAR_TARGET, beacons=BeaconWatch((Sighting(FAR, 49005, 115501, "lab-pc"),))),
         "wrong-port", ["nothing answers on 192.0.2.1:49000", "listens on port 49005", "port:=49005"]),
        (Evidence(target=Target(FAR, FAR, 49000, Chosen.OPTION),
                  beacons=BeaconWatch((Sighting("192.0.2.7", 49000, 115501, "lab-pc"),))),
         "wrong-host", ["nothing answers on 192.0.2.1:49000", "192.0.2.7:49000", "host:=192.0.2.7"]),
        (Evidence(target=FAR_TARGET, answers=Answers(refused=True)),
         "nothing-listens", ["nothing answers on 192.0.2.1:49000", "nothing listens on the port", "start X-Plane"]),
        (Evidence(target=FAR_TARGET, answers=Answers(unreachable="No route to host")),
         "no-route", ["nothing answers on 192.0.2.1:49000", "No route to host", "cable"]),
        (Evidence(target=FAR_TARGET, beacons=BeaconWatch((LAB,))),
         "dropped", ["announces itself there", "Accept incoming connections", "private", "Local Network"]),
        (Evidence(target=FAR_TARGET),
         "no-answer", ["nothing answers on 192.0.2.1:49000", "no beacon", "start X-Plane", "firewall"]),
        (Evidence(answers=Answers(refused=True)),
         "no-simulator", ["no X-Plane announces itself", "127.0.0.1:49000", "host:="]),
    ],
)  # fmt: skip
def test_why_nothing_answers(evidence, id_, words):
    only(link.answer(evidence), PROBLEM, id_, *words)


@pytest.mark.parametrize(
    ("computer", "words"),
    [
        (Computer(wsl=True), "network of WSL2 as a public one"),
        (Computer(firewall="ufw"), "sudo ufw allow proto udp from 192.0.2.1"),
        (Computer(system="Darwin"), "allow the terminal under Privacy & Security > Local Network"),
        (Computer(system="Windows"), "allow Python in private networks"),
    ],
)
def test_what_to_permit_depends_on_the_system(computer, words):
    evidence = Evidence(target=FAR_TARGET, beacons=BeaconWatch((LAB,)), computer=computer)
    only(link.answer(evidence), PROBLEM, "dropped", words, "on X-Plane's computer")


def test_from_wsl_x_plane_is_on_the_gateway():
    evidence = Evidence(computer=Computer(wsl=True, gateway="172.20.80.1"), answers=Answers(refused=True))
    only(link.answer(evidence), PROBLEM, "no-simulator", "host:=172.20.80.1", "WSL2")


def test_answers_are_reported_with_where_they_come_from():
    only(link.answer(Evidence(target=FAR_TARGET, answers=answers())), OK, "answer", "192.0.2.1:49000")
    evidence = Evidence(target=FAR_TARGET, answers=answers(sources={("192.0.2.3", 49000): 4}))
    found = only(
        link.answering_address(evidence), WARNING, "other-address",
        "answers come from 192.0.2.3", "192.0.2.1 is configured", "host:=192.0.2.3",
    )  # fmt: skip
    assert (found.facts["asked"], found.facts["from"]) == (FAR, "192.0.2.3")


def test_addresses_of_this_very_computer_and_ports_of_a_nat_are_no_fault():
    own = Evidence(target=HERE, answers=answers(sources={("127.0.0.2", 49000): 4}))
    assert link.answering_address(own) == []
    nat = Evidence(target=FAR_TARGET, answers=answers(sources={(FAR, 50001): 4}))
    only(link.answering_address(nat), NOTE, "other-port", "50001", "49000")


# -------------------------------------------------------------------------------------------------------- simulator


@pytest.mark.parametrize(
    ("number", "severity", "words"),
    [
        (105101, WARNING, "10.51 (105101)"),
        (115501, OK, "11.55 (115501)"),
        (122015, OK, "12.20 (122015)"),
        (0, NOTE, "not started"),
    ],
)
def test_versions(number, severity, words):
    evidence = Evidence(answers=answers(values={names.VERSION: float(number)}))
    only(simulator.version(evidence), severity, "version", words)


@pytest.mark.parametrize(
    ("values", "id_"),
    [({names.PAUSED: 1.0}, "paused"), ({names.REPLAY: 1.0}, "replay"), ({names.RUNNING_TIME: 10.0}, "time-stands")],
)
def test_a_simulator_that_does_not_fly_says_so(values, id_):
    only(simulator.state(Evidence(answers=answers(values=values))), NOTE, id_)
    assert simulator.state(Evidence(answers=answers())) == []


# ------------------------------------------------------------------------------------------------------ Data Output


def test_who_sits_on_x_planes_own_port():
    taken = Evidence(holders={49001: [Holder("gdl90_app", 77)]})
    only(data_output.sending_port(taken), WARNING, "port-49001-taken", "gdl90_app (process 77)", "49001", "49003")
    hidden = Evidence(holders={49001: [Holder()]})
    only(data_output.sending_port(hidden), WARNING, "port-49001-taken", "a program of another user")
    assert data_output.sending_port(Evidence(holders={49001: [Holder("X-Plane-x86_64", 77)]})) == []


def test_data_sent_to_x_planes_own_port_never_arrives():
    evidence = Evidence(data=DataWatch({(49001, FAR): (3, 20)}))
    only(data_output.sending_port(evidence), WARNING, "data-to-49001", FAR, "49001", "49003")
    assert data_output.rows(evidence) == []


def test_who_sits_on_the_port_of_the_rows():
    evidence = Evidence(holders={49003: [Holder("foreflight_sim", 5)]})
    only(data_output.receiving_port(evidence), WARNING, "data-port-taken", "foreflight_sim (process 5)", "49003")
    assert data_output.receiving_port(Evidence(holders={49003: [Holder("rx_node", 5)]})) == []
    only(data_output.receiving_port(Evidence(data_port=49001)), WARNING, "data-port", "49001")


def test_rows_that_no_program_here_requested():
    evidence = Evidence(data=DataWatch({(49003, FAR): (3, 17, 20)}))
    only(data_output.rows(evidence), WARNING, "unasked-data", "3, 17, 20", FAR, "49003", "switch it off")


def test_rows_that_go_elsewhere_are_another_clients_unless_our_journal_has_them():
    values = {names.data_row(3): 1.0, names.data_row(17): 0.0, names.data_row(20): 1.0, names.DATA_RATE: 20.0}
    evidence = Evidence(answers=answers(values=values))
    only(data_output.rows(evidence), NOTE, "data-elsewhere", "rows 3, 20", "20 times a second", "rref")
    ours = Entry("rows", "data_output", "/xplane/rx_node", 5, "lab", Owner.RUNS)
    mine = Evidence(answers=answers(values=values), journals=[Journal(Path("j"), FAR, 49000, (ours,))])
    assert data_output.rows(mine) == []


# -------------------------------------------------------------------------------------------------------- leftovers


def entry(owner, id_=f"override:{JOYSTICK}"):
    return Entry(id_, "override", "/xplane/tx_node", 4711, "lab-pc-3", owner)


@pytest.mark.parametrize(
    ("owner", "severity", "id_", "words"),
    [
        (Owner.GONE, PROBLEM, "leftovers", ["/xplane/tx_node (process 4711)", "has ended", "override_joystick",
                                            "X-Plane still shows override_joystick", "scripts/release_overrides"]),
        (Owner.STOPPED, PROBLEM, "owner-stopped", ["is stopped", "kill -CONT 4711"]),
        (Owner.ELSEWHERE, NOTE, "journal-elsewhere", ["lab-pc-3", "override_joystick"]),
        (Owner.RUNS, OK, "journal", ["runs", "override_joystick"]),
    ],
)  # fmt: skip
def test_what_a_journal_reports_depends_on_its_owner(owner, severity, id_, words):
    journal = Journal(Path("192.0.2.1_49000.json"), FAR, 49000, (entry(owner),))
    evidence = Evidence(target=FAR_TARGET, answers=answers(values={JOYSTICK: 1.0}), journals=[journal])
    only(leftovers.journals(evidence), severity, id_, "192.0.2.1:49000", *words)
    assert leftovers.overrides(evidence) == [], "what a journal has is not reported twice"


def test_leftovers_that_x_plane_does_not_show_any_more_are_still_reported():
    journal = Journal(Path("192.0.2.1_49000.json"), FAR, 49000, (entry(Owner.GONE),))
    evidence = Evidence(target=FAR_TARGET, answers=answers(values={JOYSTICK: 0.0}), journals=[journal])
    found = only(leftovers.journals(evidence), PROBLEM, "leftovers")
    assert found.facts["still_on"] == []
    assert "still shows" not in found.text


@pytest.mark.parametrize(("host", "port"), [("192.0.2.9", 49000), (FAR, 49010)])
def test_a_journal_of_another_x_plane_explains_nothing_here(host, port):
    journal = Journal(Path(f"{host}_{port}.json"), host, port, (entry(Owner.RUNS),))
    evidence = Evidence(target=FAR_TARGET, answers=answers(values={JOYSTICK: 1.0}), journals=[journal])
    only(leftovers.overrides(evidence), WARNING, "overrides-on", "override_joystick", "--all --host 192.0.2.1")


@pytest.mark.parametrize(
    ("host", "target", "is_explained"),
    [
        ("127.0.0.1", "198.51.100.7", True),
        ("198.51.100.7", "127.0.0.1", True),
        ("198.51.100.8", "198.51.100.7", True),
        ("127.0.0.1", FAR, False),
        (FAR, "127.0.0.1", False),
        ("no_address", "198.51.100.7", False),
    ],
)
def test_the_loopback_and_this_computers_address_name_one_x_plane(monkeypatch, host, target, is_explained):
    own = ("127.", "198.51.100.")
    monkeypatch.setattr("xplane_bridge.doctor.observe.computer.is_own", lambda address: address.startswith(own))
    journal = Journal(Path(f"{host}_49000.json"), host, 49000, (entry(Owner.RUNS),))
    seen = answers(values={JOYSTICK: 1.0})
    evidence = Evidence(target=Target(target, target, 49000, Chosen.OPTION), answers=seen, journals=[journal])
    assert (leftovers.overrides(evidence) == []) is is_explained


def test_a_journal_that_cannot_be_understood():
    journal = Journal(Path("192.0.2.1_49000.json"), FAR, 49000, error="ValueError: broken")
    only(leftovers.journals(Evidence(journals=[journal])), WARNING, "journal-damaged", "192.0.2.1_49000.json", "broken")


def test_overrides_of_others():
    autopilot = "sim/operation/override/override_autopilot"
    values = {names.PATH_OVERRIDE: 1.0, autopilot: 1.0}
    moved, other = leftovers.overrides(Evidence(target=FAR_TARGET, answers=answers(values=values)))
    assert (moved.id, moved.severity) == ("flight-model-off", WARNING)
    assert (other.id, other.severity) == ("other-overrides", NOTE)
    assert "override_autopilot" in other.text


# -------------------------------------------------------------------------------------------------------------- ROS

MASTER = {"uri": "http://192.0.2.1:11311", "host": FAR, "port": 11311, "address": FAR}


@pytest.mark.parametrize(
    ("facts", "severity", "id_", "words"),
    [
        (RosFacts(), NOTE, "no-ros", ["ROS_MASTER_URI is not set"]),
        (RosFacts("localhost:11311", malformed=True), PROBLEM, "master-uri", ["'localhost:11311'", "http://HOST:PORT"]),
        (RosFacts("http://lab:11311", error="the name lab is not known on this computer"),
         PROBLEM, "master-unknown-host", ["http://lab:11311", "/etc/hosts"]),
        (RosFacts(**MASTER, error="no answer within 2 s"), PROBLEM, "no-master",
         ["http://192.0.2.1:11311", "no answer within 2 s", "firewall"]),
        (RosFacts(**MASTER, refused=True, error="Connection refused"), PROBLEM, "no-master", ["start roscore"]),
        (RosFacts("http://localhost:11311", address="127.0.0.1", here=True, refused=True), NOTE, "no-master-yet",
         ["roslaunch starts one"]),
        (RosFacts("http://localhost:11399", address="127.0.0.1", here=True, refused=True), PROBLEM, "no-master",
         ["http://localhost:11399"]),
        (RosFacts(**MASTER, answered=True), OK, "master", ["http://192.0.2.1:11311"]),
    ],
)  # fmt: skip
def test_the_master(facts, severity, id_, words):
    only(ros.master(Evidence(ros=facts)), severity, id_, *words)


@pytest.mark.parametrize(
    ("names_", "severity", "id_", "words"),
    [
        ({"ip": "192.0.2.44"}, PROBLEM, "ros-name-not-here", ["ROS_IP is 192.0.2.44", "198.51.100.7"]),
        ({"ip": "my-pc"}, PROBLEM, "ros-name-not-here", ["ROS_IP is my-pc"]),
        ({"ip": "127.0.0.1"}, PROBLEM, "ros-name-loopback", ["127.0.0.1", FAR, "198.51.100.7"]),
        ({"hostname": "lab"}, PROBLEM, "ros-name-unknown", ["ROS_HOSTNAME is lab", "ROS_IP"]),
        ({"hostname": "lab", "hostname_address": "192.0.2.44"}, PROBLEM, "ros-name-not-here", ["ROS_HOSTNAME is lab"]),
        ({"hostname_address": "127.0.1.1"}, WARNING, "ros-name-unset", ["neither", "my-pc", "198.51.100.7"]),
    ],
)
def test_a_name_that_others_cannot_use(names_, severity, id_, words):
    computer = Computer(name="my-pc", addresses=("198.51.100.7",))
    evidence = Evidence(ros=RosFacts(**MASTER, answered=True, **names_), computer=computer)
    only(ros.own_name(evidence), severity, id_, *words)


def test_two_names_that_differ():
    facts = RosFacts(**{**MASTER, "address": "127.0.0.1"}, here=True, ip="127.0.0.1",
                     hostname="localhost", hostname_address="127.0.0.2")  # fmt: skip
    only(ros.own_name(Evidence(ros=facts)), WARNING, "ros-names-differ", "localhost", "127.0.0.1")


@pytest.mark.parametrize(
    "names_", [{}, {"ip": "127.0.0.1"}, {"hostname": "localhost", "hostname_address": "127.0.0.1"}]
)
def test_with_the_master_here_the_loopback_will_do(names_):
    facts = RosFacts("http://localhost:11311", address="127.0.0.1", here=True, answered=True, **names_)
    assert ros.own_name(Evidence(ros=facts)) == []


def test_nodes_that_cannot_be_reached_where_they_say():
    bad = Node("/xplane/rx_node", "http://lab-pc:4711", "its name is not known on this computer")
    good = Node("/xplane/tx_node", "http://127.0.0.1:4712")
    facts = RosFacts(**MASTER, answered=True, nodes=(bad, good))
    found, fine = ros.nodes(Evidence(ros=facts))
    only([found], PROBLEM, "node-unreachable", "/xplane/rx_node", "http://lab-pc:4711", "ROS_IP")
    only([fine], OK, "nodes", "/xplane/tx_node")
    only(ros.nodes(Evidence(ros=RosFacts(**MASTER, answered=True))), NOTE, "no-nodes", "/xplane")


# ---------------------------------------------------------------------------------------------------------- devices


def shown(*windows, **more):
    return Evidence(target=HERE, answers=answers(), display=Display(":3", windows), **more)


def test_without_x_planes_window_the_titles_there_are_are_listed():
    evidence = shown(Window("X-Plane 12 - Mozilla Firefox", 800, 600, True), Window("Terminal", 400, 300, True))
    found = only(
        window.window(evidence), WARNING, "no-window",
        '"X-System" or "X-Plane"', ":3", '"X-Plane 12 - Mozilla Firefox", "Terminal"', "window/title",
    )  # fmt: skip
    assert found.facts["titles"] == ["X-Plane 12 - Mozilla Firefox", "Terminal"]


def test_x_planes_own_window_is_preferred():
    evidence = shown(Window("X-Plane", 1920, 1080, True, "totem"), Window("X-System", 640, 480, True, "X-Plane-x86_64"))
    found = only(window.window(evidence), OK, "window", "X-System", "640x480", "X-Plane-x86_64")
    assert found.facts["program"] == "X-Plane-x86_64"


def test_a_title_that_the_user_gives_matches_a_part():
    evidence = shown(Window("My X-Plane cockpit", 640, 480, True), settings=Settings(window_title="cockpit"))
    only(window.window(evidence), OK, "window", "My X-Plane cockpit")


def test_windows_that_give_no_pictures_or_slow_ones():
    only(window.window(shown(Window("X-System", 640, 480, False))), WARNING, "window-hidden", "minimised")
    slow = Window("X-System", 3840, 2160, True, grab_s=0.045)
    only(window.window(shown(slow)), WARNING, "slow-grab", "45.0 ms", "max_rate")
    quick = Window("X-System", 640, 480, True, grab_s=0.0031)
    only(window.window(shown(quick)), OK, "window", "3.1 ms")


def test_where_no_window_can_be_nothing_is_wrong():
    only(window.window(Evidence(target=FAR_TARGET, answers=answers())), NOTE, "window-elsewhere", "capture_node")
    only(window.window(Evidence(target=HERE, answers=answers())), NOTE, "no-display", "DISPLAY")
    only(window.window(Evidence(target=HERE, display=Display(":3"))), NOTE, "no-window", "none", "start X-Plane")
    refused = Evidence(target=HERE, answers=answers(), display=Display(":9", error="it takes no connection"))
    only(window.window(refused), WARNING, "display", ":9", "no connection")


def test_joysticks():
    denied = Evidence(joysticks=Joysticks((Joystick("/dev/input/js0", "Extreme 3D", False),)))
    only(joystick.joystick(denied), WARNING, "joystick-denied", "/dev/input/js0", "Extreme 3D", "input")
    half = Evidence(joysticks=Joysticks((Joystick("/dev/input/js0", "Extreme 3D", True, "/dev/input/event5", False),)))
    words = ("/dev/input/js0", "driver:=sdl", "/dev/input/event5", "usermod -aG input")
    only(joystick.joystick(half), WARNING, "joystick-event-denied", *words)
    whole = Evidence(joysticks=Joysticks((Joystick("/dev/input/js0", "Extreme 3D", True, "/dev/input/event5", True),)))
    only(joystick.joystick(whole), OK, "joystick", "/dev/input/js0")
    only(joystick.joystick(Evidence()), NOTE, "no-joystick", "/dev/input")
    assert joystick.joystick(Evidence(joysticks=Joysticks(supported=False))) == []


def test_the_clock():
    only(clock.clock(Evidence(clock=ClockWatch(-0.25, 6.0, True))), WARNING, "clock-step", "-0.250 s", "chrony")
    only(clock.clock(Evidence(clock=ClockWatch(0.0, 6.0, False))), NOTE, "clock-free", "chrony")
    only(clock.clock(Evidence(clock=ClockWatch(0.0005, 6.0, None))), OK, "clock")
