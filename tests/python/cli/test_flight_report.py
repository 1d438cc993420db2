"""The report of an analytic flight: what it says, and that a real browser shows it without an error."""

from __future__ import annotations

import errno
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from support.deadlines import PROGRAM_S
from support.flights.export_flight import write_flight
from support.flights.synthetic_flight import FlightBag, record_a_clock_set_back, stamp_ns, write_states
from xplane_bridge.analysis.quality import QUALITY_WORDS
from xplane_bridge.bags import Bags
from xplane_bridge.bags.flight import read_flight
from xplane_bridge.cli import flight_report
from xplane_bridge.plotting import flight_figures
from xplane_bridge.plotting.page_file import write_page
from xplane_bridge.plotting.spec import SHADES, Panel, Series
from xplane_bridge.resources import share_dir

RATE = 50.0


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """20 s with every topic the report knows, a gap of 2 s after 10 s, an aileron stuck from 14 s on, a failsafe."""
    path = tmp_path_factory.mktemp("full") / "flight.bag"
    with FlightBag(path) as bag:
        for k in range(1000):
            t = k / RATE + (2.0 if k >= 500 else 0.0)
            ns = stamp_ns(t)
            state = bag.state(t, k)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, state)
            header = bag.header(ns, "base_link_frd", k)
            if k % 5 == 0:
                roll = math.sin(t)
                controls = {"header": header, "valid": 1023, "stick_roll": roll, "total_roll": 0.9 * roll}
                bag.add("/xplane/mission/controls", "xplane_bridge/ControlStates", ns, controls)
                aileron = [0, 0, 10 * roll, -10 * roll, 0, 0, 0, 0]
                surfaces = {"header": header, "valid": 2047, "aileron1": aileron, "elevator": [1, 1, 0, 0]}
                bag.add("/xplane/mission/surfaces", "xplane_bridge/SurfaceStates", ns, surfaces)
                engines = {"header": header, "count": 2, "throttle_actual": [0.7, 0.6] + [0] * 6}
                engines["engine_speed"] = [2400, 2300] + [0] * 6
                bag.add("/xplane/mission/engines", "xplane_bridge/EngineStates", ns, engines)
                applied = {"header": header, "fields": 9, "roll": roll, "throttles": [0.7] * 8, "engine_count": 2}
                bag.add("/xplane/control/applied", "xplane_bridge/AppliedCommand", ns, applied)
            if k % 25 == 0:
                image_header = bag.header(ns, "camera_forward_optical", k)
                pixels = np.full((48, 64, 3), (k // 4) % 256, np.uint8)
                image = {"header": image_header, "format": "jpeg", "data": cv2.imencode(".jpg", pixels)[1].reshape(-1)}
                bag.add("/xplane/camera/image_raw/compressed", "sensor_msgs/CompressedImage", ns, image)
                frame = {"header": image_header, "state": state, "sim_time_error": 0.001}
                bag.add("/xplane/camera/frame_state", "xplane_bridge/FrameState", ns, frame)
        for t, mode, failsafe, who, why in (
            (0.0, 1, False, "", "start"),
            (5.0, 2, False, "/pilot", "request"),
            (16.0, 2, True, "", "timeout of control/auto"),
            (18.0, 2, False, "", "control/auto is back"),
        ):
            ns = stamp_ns(t)
            values = {"mode": mode, "failsafe": failsafe, "requested_by": who, "reason": why}
            bag.add("/xplane/control/mode", "xplane_bridge/ControlMode", ns, {"header": bag.header(ns, ""), **values})
        ns = stamp_ns(14.0)
        failure = {"header": bag.header(ns, ""), "names": ["aileron1_wing2_left"], "kinds": ["stuck"], "values": [5.0]}
        failure.update(set_by=["bridge"], active=[True], confirmed=[True], since_sim_time=[14.0])
        bag.add("/xplane/failures/state", "xplane_bridge/FailureState", ns, failure)
        event = {
            "number": 1,
            "stamp": {"sec": ns // 10**9, "nanosec": 0},
            "text": "<aileron> stuck",
            "requested_by": "me",
        }
        bag.add("/xplane/events", "xplane_bridge/EventList", ns, {"events": [event]})
        later = stamp_ns(19.0)  # of another tx_node, which counts anew
        again = {**event, "stamp": {"sec": later // 10**9, "nanosec": 0}, "text": "<aileron> repaired"}
        for _ in range(2):
            bag.add("/xplane/events", "xplane_bridge/EventList", later, {"events": [again]})
        for t, active in ((15.0, True), (15.5, True), (16.5, False)):
            ns = stamp_ns(t)
            gust = {"header": bag.header(ns, ""), "active": active, "kind": "gust"}
            bag.add("/xplane/disturbance/state", "xplane_bridge/DisturbanceState", ns, gust)
        for t, label in ((1.0, "climb"), (13.5, "<break>"), (20.0, "")):
            bag.add("/xplane/scenario/label", "std_msgs/String", stamp_ns(t), {"data": label})
        bag.add("/other", "std_msgs/String", stamp_ns(2.0), {"data": "not the scenario's"})
        made = {"package_version": "0.2.0", "parameters": '{"experiment": {"pilot": "Kim"}}', "xplane_version": 115501}
        bag.add("/xplane/experiment", "xplane_bridge/Experiment", stamp_ns(0.0), made)
        for t, state in ((0.0, 1), (10.0, 3), (12.0, 1)):
            ns = stamp_ns(t)
            bag.add("/xplane/link_state", "xplane_bridge/LinkState", ns, {"header": bag.header(ns, ""), "state": state})
    return path


@pytest.fixture(scope="module")
def page(full: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    assert flight_report.main([str(full), "-o", str(folder / "report.html"), "--png", str(folder / "png")]) == 0
    return folder / "report.html"


def section(page: Path, key: str) -> str:
    text = page.read_text()
    return text[text.index(f'<section id="{key}">') :].split("</section>")[0]


def test_the_summary_reports_the_flight(page: Path) -> None:
    text = section(page, "summary")
    assert "<b>21.98 s</b><span>duration</span>" in text
    # 60 m/s over two stretches of 499 periods of 20 ms
    assert "<b>1198 m</b><span>distance over ground</span>" in text
    assert "&lt;aileron&gt; stuck" in text, "text from a bag must be escaped"
    assert re.search("&lt;aileron&gt; stuck.*&lt;aileron&gt; repaired", text, re.DOTALL), "each node counts from 1"
    assert text.count("&lt;aileron&gt; repaired") == 1
    assert re.search(r">stale</td>", text)


def test_a_failsafe_is_distinguished_from_the_automatic_flight_it_interrupts(page: Path) -> None:
    table = section(page, "summary").split("<h3>Who flew</h3>")[1].split("</table>")[0]
    rows = [re.findall(r"<td.*?>(.*?)</td>", row) for row in table.split("<tr>")[2:]]
    assert rows == [
        ["0.0", "5.0", "manual", "start", ""],
        ["5.0", "11.0", "auto", "request", "/pilot"],
        ["16.0", "2.0", '<span class="bad">failsafe</span>', "timeout of control/auto", ""],
        ["18.0", "4.0", "auto", "control/auto is back", ""],
    ]
    attitude = section(page, "attitude")
    shapes = re.findall(r'"fillcolor":"(#\w+)".*?"x0":([-\d.]+),"x1":([-\d.]+)', attitude)
    shaded = {(colour, float(x0), float(x1)) for colour, x0, x1 in shapes}
    assert {(SHADES["auto"], 5.0, 16.0), (SHADES["failsafe"], 16.0, 18.0), (SHADES["auto"], 18.0, 21.98)} <= shaded
    assert '"text":"failsafe"' in attitude


def test_a_disturbance_of_the_air_is_shaded(page: Path) -> None:
    attitude = section(page, "attitude")
    shapes = re.findall(r'"fillcolor":"(#\w+)".*?"x0":([-\d.]+),"x1":([-\d.]+)', attitude)
    assert {(float(x0), float(x1)) for colour, x0, x1 in shapes if colour == SHADES["disturbance"]} == {(15.0, 16.5)}
    assert '"text":"gust"' in attitude


def test_the_labels_of_a_scenario_are_listed(page: Path) -> None:
    text = section(page, "summary")
    table = text.split("<h3>Scenario</h3>")[1].split("</table>")[0]
    rows = [re.findall(r"<td.*?>(.*?)</td>", row) for row in table.split("<tr>")[2:]]
    assert rows == [["1.0", "12.5", "climb"], ["13.5", "6.5", "&lt;break&gt;"]]
    assert "not the scenario" not in text


def test_every_section_is_there_and_filled(page: Path) -> None:
    keys = re.findall(r'<section id="(\w+)">', page.read_text())
    assert keys == [
        "summary", "attitude", "airspeed", "altitude", "airflow", "rates", "loads", "controls", "surfaces", "engines",
        "track", "path", "images", "quality", "experiment",
    ]  # fmt: skip
    for key in keys[:-1]:  # this recording does not say how it was made
        assert "Not shown" not in section(page, key), key


def test_the_last_section_says_how_it_was_made(page: Path) -> None:
    text = section(page, "experiment")
    for name, value in (("package version", "0.2.0"), ("X-Plane", "115501"), ("experiment/pilot", "Kim")):
        assert f"<td>{name}</td><td>{value}</td>" in text


def test_a_recording_called_as_most_goes_by_its_folder(full: Path, page: Path) -> None:
    assert f"<h1>Flight report: {full.parent.name}</h1>" in page.read_text()


def test_sideslip_says_whose_sign_it_has(page: Path) -> None:
    text = section(page, "airflow")
    assert '"name":"computed, wind from the right +"' in text
    assert "sign disputed" in text


def test_the_quality_section_finds_the_gap_and_judges_physics(page: Path) -> None:
    text = section(page, "quality")
    row = re.search(r"<td>/xplane/flight_state</td>(.*?)</tr>", text).group(1)
    cells = [re.sub("<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)]
    assert cells[0] == "1000"
    assert cells[3] == "1"
    assert cells[4] == "2.02"
    assert "1 epoch, 2 stretches without a gap" in text
    rates = re.search(r"<tr><td>attitude against p, q, r</td>.*?</tr>", text).group(0)
    assert "holds" in rates
    # The analytic flight carries no centripetal load: the check must say so.
    force = re.search(r"<tr><td>specific force against dv/dt</td>.*?</tr>", text).group(0)
    assert "violated" in force
    assert "40 images, 100.0 % with a state, 100.0 % without" in text


def test_quality_bits_of_the_pictures_are_said_in_words(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag")  # one of 19 is frozen, one interpolated with a delay that is assumed
    assert flight_report.main([str(bag), "-o", str(tmp_path / "report.html")]) == 0
    text = section(tmp_path / "report.html", "quality")
    rows = re.findall(r"<tr><td>([a-z ]+)</td><td>([^<]+)</td><td[^>]*>([\d.]+) %</td></tr>", text)
    assert rows == [
        ("interpolated", "its state lies between two received ones, which come more slowly than frames", "5.3"),
        ("frozen", "the window stood still while the aircraft moved", "5.3"),
        ("delay assumed", "the delay of the display was not measured: the state may be frames off", "5.3"),
    ]


def test_each_quality_bit_has_words() -> None:
    text = (share_dir() / "msg" / "FrameState.msg").read_text(encoding="utf-8")
    assert set(re.findall(r"^uint32 QUALITY_(\w+) *=", text, re.MULTILINE)) == set(QUALITY_WORDS)


def test_commanded_achieved_and_failures_are_drawn(page: Path) -> None:
    controls = section(page, "controls")
    assert '"name":"commanded"' in controls
    assert '"name":"at the surfaces"' in controls
    surfaces = section(page, "surfaces")
    assert '"name":"wing 2 left"' in surfaces
    assert '"name":"wing 1 left"' not in surfaces, "a wing without an aileron is not a line"
    assert "aileron1_wing2_left stuck" in surfaces
    assert '"text":"auto"' in surfaces


def test_the_strip_shows_twelve_pictures_with_their_state(page: Path) -> None:
    text = section(page, "images")
    assert text.count("<img") == 12
    assert text.count("time error 1.0 ms") == 12


def test_png_files_are_pictures(page: Path) -> None:
    names = {p.stem for p in (page.parent / "png").glob("*.png")}
    assert len(names) == 11
    for name in names:
        image = cv2.imread(str(page.parent / "png" / f"{name}.png"))
        assert image.shape[1] > 1000
        assert image.std() > 5, f"{name}.png is empty"


def browser() -> str:
    for name in ("chromium", "chromium-browser", "google-chrome"):
        found = shutil.which(name)
        if found:
            return found
    pytest.fail("no Chromium to open the report with: apt-get install chromium (scripts/setup does)")


#: Runs in the page: zooms one figure and writes down what the others show.
PROBE = """
<script>
window.addEventListener('load', () => {
  const all = [...document.querySelectorAll('[data-time] .plotly-graph-div')];
  Plotly.relayout(all[0], {'xaxis.range': [3, 7]}).then(() => setTimeout(() => {
    document.body.dataset.ranges = JSON.stringify(all.map(f => f.layout.xaxis.range));
  }, 0));
});
</script>
"""


def test_a_real_browser_opens_it_offline_and_links_the_time_axes(page: Path, tmp_path: Path) -> None:
    text = page.read_text()
    loads = re.findall(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?!data:)[^"]*"', text)
    assert not loads, "the page must need no network"
    probed = tmp_path / "probed.html"
    probed.write_text(text.replace("</body>", PROBE + "</body>"))
    command = [
        browser(), "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
        "--disable-component-update", "--disable-sync", f"--user-data-dir={tmp_path / 'profile'}",
        "--enable-logging=stderr", "--virtual-time-budget=20000", "--dump-dom", f"file://{probed}",
    ]  # fmt: skip
    run = subprocess.run(command, capture_output=True, text=True, timeout=PROGRAM_S)
    errors = [line for line in run.stderr.splitlines() if "CONSOLE" in line and ("Uncaught" in line or "Error" in line)]
    assert not errors
    assert 'data-linked="9"' in run.stdout
    ranges = re.search(r'data-ranges="(.*?)"', run.stdout).group(1)
    assert ranges == "[" + ",".join(["[3,7]"] * 9) + "]"
    assert run.stdout.count('class="main-svg"') >= 20


def test_missing_topics_are_said_and_the_rest_stands(tmp_path: Path) -> None:
    write_states(tmp_path / "bare.bag", 2.0, 50.0)
    assert flight_report.main([str(tmp_path / "bare.bag"), "-o", str(tmp_path / "r.html")]) == 0
    page = tmp_path / "r.html"
    assert "<h1>Flight report: bare</h1>" in page.read_text()
    for key, topic in (
        ("controls", "mission/controls"),
        ("surfaces", "mission/surfaces"),
        ("engines", "mission/engines"),
    ):
        assert f"Not shown: the bag has no {topic}" in section(page, key)
    assert "no compressed camera images" in section(page, "images")
    assert "figure-attitude" in section(page, "attitude")


def test_a_recording_of_a_pause_gets_a_page(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "paused.bag") as bag:
        for k in range(100):
            ns = stamp_ns(k / 20)
            state = {**bag.state(0.0, k), "header": bag.header(ns, "base_link_frd", k), "paused": True}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, state)
    page = tmp_path / "r.html"
    assert flight_report.main([str(tmp_path / "paused.bag"), "-o", str(page)]) == 0
    assert section(page, "quality").count("nothing to compare") == 3


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of 12 s of flight straight north that took 18 s of real time."""
    folder = tmp_path_factory.mktemp("slow")
    with FlightBag(folder / "flight.bag") as bag:
        for k in range(240):
            t, ns = k / 20, stamp_ns(1.5 * k / 20)
            header = bag.header(ns, "base_link_frd", k)
            state = {**bag.state(t, k), "header": header, "frame_period": np.float32(0.05)}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, state)
            pose = {"position": {"x": 60.0 * t, "y": 0.0, "z": 0.0}, "orientation": {"w": 1.0}}
            odom = {"pose": {"pose": pose}, "twist": {"twist": {"linear": {"x": 60.0}}}}
            bag.add("/xplane/odom", "nav_msgs/Odometry", ns, {"header": bag.header(ns, "map", k), **odom})
    assert flight_report.main([str(folder / "flight.bag"), "-o", str(folder / "report.html")]) == 0
    return folder / "report.html"


def test_a_simulator_slower_than_real_time_does_not_break_physics(slow: Path) -> None:
    row = re.search(r"<tr><td>odometry: position against twist</td>.*?</tr>", section(slow, "quality")).group(0)
    assert "holds" in row


def test_a_simulator_slower_than_real_time_is_said(slow: Path, page: Path) -> None:
    text = section(slow, "summary")
    assert "X-Plane ran slower than real time, at 13 frames/s: 11.9 s of its time took 17.9 s, 1.5 times as" in text
    assert "<b>717 m</b><span>distance over ground</span>" in text
    assert "slower than real time" not in section(page, "summary")


def test_slow_states_count(tmp_path: Path) -> None:
    write_states(tmp_path / "slow.bag", 60.0, 1.0)
    page = tmp_path / "r.html"
    assert flight_report.main([str(tmp_path / "slow.bag"), "-o", str(page)]) == 0
    assert "<b>3540 m</b><span>distance over ground</span>" in section(page, "summary")
    assert "1 stretch without a gap" in section(page, "quality")


def test_a_bag_without_state_gets_a_page_and_an_error(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with FlightBag(tmp_path / "link.bag") as bag:
        bag.add("/xplane/link_state", "xplane_bridge/LinkState", stamp_ns(0), {"state": 0})
    page = tmp_path / "r.html"
    assert flight_report.main([str(tmp_path / "link.bag"), "-o", str(page)]) == 1
    assert "the bag has no flight_state" in section(page, "summary")
    err = capsys.readouterr().err
    assert f"{tmp_path / 'link.bag'}: no flight state in it" in err
    assert str(page) in err
    assert "record flight_state" in err
    assert err.count("\n") == 1


def test_long_flights_stay_small_and_keep_their_peaks(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "long.bag") as bag:
        for k in range(60_000):
            state = bag.state(k / 100, k)
            if k == 31_415:
                state["load_factor_normal"] = 7.25
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 100), state)
    page = tmp_path / "r.html"
    assert flight_report.main([str(tmp_path / "long.bag"), "-o", str(page)]) == 0
    assert page.stat().st_size < 15e6
    assert "<b>7.25 g</b><span>highest load factor</span>" in section(page, "summary")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["none.bag"], "No such file"),
        (["empty.bag"], "nothing was recorded"),
        (["good.bag", "-o", "dir"], "Is a directory"),
        (["good.bag", "-o", "./good.bag"], "good.bag: the recording itself is there; expected another file"),
    ],
)
def test_errors_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, arguments: list, text: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dir").mkdir()
    write_states(tmp_path / "good.bag", 0.1, 50.0)
    with FlightBag(tmp_path / "empty.bag"):
        pass
    assert flight_report.main(arguments) == 1
    err = capsys.readouterr().err
    assert text in err
    assert err.count("\n") == 1
    assert (tmp_path / "good.bag").read_bytes().startswith(b"#ROSBAG V2.0")


def test_a_bag_whose_name_is_no_text_has_a_report(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"fl\xfcg.bag")
    write_states(path, 0.1, 50.0)
    assert flight_report.main([str(path), "-o", str(tmp_path / "r.html")]) == 0
    assert "fl\\udcfcg.bag" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_an_earlier_report_stays_where_the_new_one_cannot_be_written(tmp_path: Path, monkeypatch: Any) -> None:
    def full(_part: Path, _page: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "part")

    page = tmp_path / "r.html"
    write_page(page, "earlier")
    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match=r"No space left on device: .*r\.html"):
        write_page(page, "later")
    assert page.read_text() == "earlier"
    assert list(tmp_path.iterdir()) == [page]


def test_a_mode_that_is_older_than_the_recording_does_not_stretch_it(tmp_path: Path) -> None:
    """control/mode is latched: its first message came 600 s before the recording that has it."""
    path = tmp_path / "f.bag"
    with FlightBag(path) as bag:
        mode = {"header": bag.header(stamp_ns(-600.0), ""), "mode": 1, "reason": "start"}
        bag.add("/xplane/control/mode", "xplane_bridge/ControlMode", stamp_ns(-1.0), mode)
        for k in range(100):
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 50), bag.state(k / 50, k))
    with Bags(path) as bags:
        flight = read_flight(bags)
    shaded = [(e.start - flight.start, e.end - flight.start) for _, e in flight_figures.episodes(flight)]
    assert shaded == [(0, flight.end - flight.start)]
    assert flight_report.main([str(path), "-o", str(tmp_path / "r.html")]) == 0
    table = re.search(r"Who flew</h3>.*?</table>", (tmp_path / "r.html").read_text()).group(0)
    assert re.findall(r"<td[^>]*>([^<]*)</td>", table)[:5] == ["-1.0", "3.0", "manual", "start", ""]


def test_a_warning_about_the_recording_is_a_line_of_the_program(tmp_path: Path) -> None:
    path = tmp_path / "f.bag"
    record_a_clock_set_back(path)
    program = "import sys; from xplane_bridge.cli.flight_report import main; sys.exit(main())"
    command = [sys.executable, "-W", "ignore", "-c", program, str(path), "-o", str(tmp_path / "r.html")]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stderr
    assert said.startswith(f"{path}: the host's clock was set back in flight")
    assert said.count("\n") == 1


def test_a_value_that_only_rounds_does_not_fill_its_axes_with_noise() -> None:
    time = np.arange(4, dtype=np.int64)
    still = Panel("wind [m/s]", [Series("wind speed", time, np.array([2.0, 2.0 + 1e-12, np.nan, 2.0]))])
    assert still.flat_range() == pytest.approx((1.5, 2.5))
    assert Panel("roll [deg]", [Series("roll", time, np.array([0.0, 0.1, 0.2, 0.1]))]).flat_range() is None
    assert Panel("empty", [Series("none", time, np.full(4, np.nan))]).flat_range() is None
