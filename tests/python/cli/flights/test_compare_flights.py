"""compare_flights: matched by time, scenario or event; one page that a browser shows; refusals in words."""

from __future__ import annotations

import json
import re
import shutil
import subprocess

import pytest

from support.flights.cut_off import cut_off
from support.flights.synthetic_flight import START, FlightBag, stamp_ns
from xplane_bridge.cli.flights import compare_flights
from xplane_bridge.cli.flights.compare_flights import CompareError, matched, read

SCENARIO = """
name: weave
events: [{at: 0, mode: auto}, {at: 20, end: true}]
criteria:
  level: {measure: rms, of: roll, target: 0, below: 30}
  climb: {measure: maximum, of: altitude, below: 2000}
"""
RATE = 10.0


def write(path, begin=0.0, event=5.0, higher=0.0, commit="abc", played=True, earlier=()):
    """20 s of flight; `begin` [s]: when its scenario began; `event` [s]: when an aileron stuck, `earlier` too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    flight = {"scenario": "weave", "text": SCENARIO, "options": []}
    with FlightBag(path) as bag:
        for k in range(int(20 * RATE)):
            t = k / RATE
            state = bag.state(t, k)
            state["altitude_msl"] += higher
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), state)
        values = {"commit": commit, "parameters": json.dumps({"experiment": {"flight": flight}})}
        bag.add("/xplane/experiment", "xplane_bridge/Experiment", stamp_ns(0.0), values)
        reported = [stuck(number, time) for number, time in enumerate((*earlier, event), 1)]
        if earlier:  # the latched list, as of when the recording began
            bag.add("/xplane/events", "xplane_bridge/EventList", stamp_ns(0.0), {"events": reported[:-1]})
        bag.add("/xplane/events", "xplane_bridge/EventList", stamp_ns(event), {"events": reported})
    if played:
        first = {"epoch": int(state["epoch"]), "sim_time_unwrapped": first_sim_time(path) + begin}
        log = {"scenario": "weave", "begin": first, "labels": {}}
        (path.parent / "played.json").write_text(json.dumps(log), encoding="utf-8")
    return path


def stuck(number, time):
    """An Event."""
    stamp = {"sec": START + int(time // 1), "nanosec": int(time % 1 * 1e9)}
    return {"number": number, "stamp": stamp, "text": "aileron stuck"}


def first_sim_time(path):
    return float(read([path], "").flight.tables["state"]["sim_time_unwrapped"][0])


def page_of(*arguments):
    output = arguments[-1]
    assert compare_flights.main([*map(str, arguments[:-1]), "-o", str(output)]) == 0
    return output.read_text(encoding="utf-8")


def test_two_flights_of_a_scenario_are_matched_by_its_begin(tmp_path):
    a = write(tmp_path / "a" / "flight.bag", begin=2.0)
    b = write(tmp_path / "b" / "flight.bag", begin=3.0, higher=2.0, commit="def")
    found = [matched(read([path], str(path)), path.parent.name, "scenario", None) for path in (a, b)]
    assert [round(float(each.time[0]), 3) for each in found] == [-2.0, -3.0]
    assert found[1].scores["climb"] - found[0].scores["climb"] == pytest.approx(2.0)
    page = page_of(a, b, tmp_path / "page.html")
    assert "matched by the begin of the scenario" in page
    for name in "ab":
        assert f"{name}/flight.bag" in page
    row = re.search(r"<tr><td>altitude MSL</td>.*?</tr>", page).group(0)
    assert "<td class=n>4</td>" in row  # 2 m higher, and 1 s later at 2 m/s
    assert re.search(r"<tr><td>commit</td><td>abc</td><td>def</td></tr>", page)
    assert "http" not in re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)


def test_matched_by_time_equal_flights_are_equal(tmp_path):
    a, b = (write(tmp_path / name / "flight.bag") for name in "ab")
    page = page_of(a, b, "--match", "time", tmp_path / "page.html")
    assert "matched by the first flight state" in page
    assert re.search(r"<tr><td>roll</td>.*?equal", page)
    assert "Nothing: all were made alike" in page


def test_matched_by_an_event(tmp_path):
    a, b = write(tmp_path / "a.bag", event=5.0, played=False), write(tmp_path / "b.bag", event=7.5, played=False)
    found = [matched(read([path], ""), "x", "event", "Stuck") for path in (a, b)]
    assert [round(float(each.time[0]), 3) for each in found] == [-5.0, -7.5]
    assert "aileron" in page_of(a, b, "--event", "aileron", tmp_path / "page.html")


def test_events_of_earlier_flights_in_the_latched_list_match_nothing(tmp_path, capsys):
    a = write(tmp_path / "a.bag", event=5.0, played=False)
    b = write(tmp_path / "b.bag", event=7.5, played=False, earlier=(-300.0, -120.0))
    found = [matched(read([path], ""), "x", "event", "stuck") for path in (a, b)]
    assert [round(float(each.time[0]), 3) for each in found] == [-5.0, -7.5]
    c = write(tmp_path / "c.bag", event=-60.0, played=False)
    assert compare_flights.main([str(a), str(c), "--event", "stuck", "-o", str(tmp_path / "page.html")]) == 1
    said = capsys.readouterr().err
    assert "c.bag: no event with 'stuck' in it between its first and its last flight state" in said
    assert said.endswith("it has: no event at all\n")


def test_a_label_counts_where_it_comes_again_in_the_flight(tmp_path):
    path = tmp_path / "a.bag"
    with FlightBag(path) as bag:
        for k in range(100):
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / RATE), bag.state(k / RATE, k))
        for t in (-1.0, 4.0, 8.0):  # at first the latched one of an earlier flight
            bag.add("/xplane/scenario/label", "std_msgs/String", stamp_ns(t), {"data": "turn"})
    assert round(float(matched(read([path], ""), "x", "event", "turn").time[0]), 3) == -4.0


def write_split(folder, labels):
    """Two parts of 4 s, each with its labels (time [s] and text) written before its states."""
    paths = [folder / f"flight_{part}.bag" for part in range(2)]
    for part, path in enumerate(paths):
        with FlightBag(path) as bag:
            for t, text in labels[part]:
                bag.add("/xplane/scenario/label", "std_msgs/String", stamp_ns(t), {"data": text})
            for k in range(40 * part, 40 * (part + 1)):
                bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / RATE), bag.state(k / RATE, k))
    return paths


def test_a_label_that_a_part_of_a_split_recording_repeats_is_no_event(tmp_path):
    # rosbag writes it at the split, before messages that it has received earlier.
    paths = write_split(tmp_path, ([(-0.05, "aileron stuck")], [(4.15, "aileron stuck")]))
    with pytest.raises(CompareError, match="only before or after; it has: no event at all"):
        matched(read(paths, ""), "x", "event", "aileron")


def test_a_label_that_is_set_at_a_split_is_an_event(tmp_path):
    # The first one is repeated, the second one was set while it still waited to be written.
    paths = write_split(tmp_path, ([(-0.05, "turn")], [(4.15, "turn"), (4.2, "aileron stuck")]))
    assert round(float(matched(read(paths, ""), "x", "event", "aileron").time[0]), 3) == -4.2


def test_a_flight_with_a_reset_is_equal_to_itself(tmp_path):
    path = tmp_path / "a.bag"
    with FlightBag(path) as bag:
        for k in range(100):
            state = {**bag.state(k / RATE, k), "epoch": 1 + (k >= 40)}
            state["sim_time_unwrapped"] -= 4.0 * (k >= 40)
            state["altitude_msl"] += 500.0 * (k >= 40)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / RATE), state)
    again = shutil.copy(path, tmp_path / "b.bag")
    page = page_of(path, again, tmp_path / "page.html")
    for signal in ("altitude MSL", "true heading", "roll"):
        assert "equal" in re.search(rf"<tr><td>{signal}</td>.*?</tr>", page).group(0)


def test_a_frame_that_a_pause_repeats_counts_once(tmp_path):
    def fly(path, rate_deg_s, paused_for=0):
        host = 0.0
        with FlightBag(path) as bag:
            for k in range(100):
                for repeated in range(1 + (paused_for if k == 90 else 0)):
                    state = bag.state(k / RATE, k)
                    state.update(header=bag.header(stamp_ns(host), ""), paused=bool(repeated))
                    state["roll_deg"] = rate_deg_s * k / RATE
                    bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(host), state)
                    host += 1.0 / RATE
        return path

    level = fly(tmp_path / "level.bag", 0.0)
    paused = fly(tmp_path / "paused.bag", 0.0, paused_for=200)
    rolls = fly(tmp_path / "rolls.bag", 1.0)
    rows = [
        re.search(r"<tr><td>roll</td>.*?</tr>", page_of(reference, rolls, tmp_path / "page.html")).group(0)
        for reference in (level, paused)
    ]
    assert rows[0] == rows[1]
    assert "<td class=n>4.95</td>" in rows[0]  # mean of 0, 0.1, ... 9.9
    found = matched(read([paused], ""), "x", "time", None)
    assert len(found.time) == 100
    assert found.parts == [slice(0, 100)]


def write_part(path, start, higher=0.0):
    """5 s of flight that begin at `start` [s]."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with FlightBag(path) as bag:
        for k in range(int(5.0 * RATE)):
            t = start + k / RATE
            state = bag.state(t, k)
            state["altitude_msl"] += higher
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(t), state)
    return path


@pytest.mark.parametrize(
    "names",
    [
        [f"flight_{k}.bag" for k in range(12)],  # sorted as text, 10 comes before 2
        [f"flight_2026-11-28-07-{k:02d}-30_{k}.bag" for k in range(12)],  # as record.launch names them
    ],
)
def test_the_parts_of_a_split_recording_are_one_flight(tmp_path, names):
    for folder, higher in (("before", 0.0), ("after", 3.0)):
        for k, name in enumerate(names):
            write_part(tmp_path / folder / name, 5.0 * k, higher)
    before, after = tmp_path / "before", tmp_path / "after"
    page = page_of(before, after, tmp_path / "page.html")
    assert "<h1>2 flights compared</h1>" in page
    assert f"after/{names[0]} (12 parts)" in page
    assert "0 to 59.9" in page
    row = re.search(r"<tr><td>altitude MSL</td>.*?</tr>", page).group(0)
    assert "<td class=n>3</td>" in row
    # So is what was cut off while its last part was recorded.
    cut_off(after / names[-1])
    assert page_of(before, after, tmp_path / "page.html").count("(12 parts)") == page.count("(12 parts)")
    # So are parts that are named one by one, in whatever order.
    files = [path for folder in (before, after) for path in sorted(folder.iterdir())]
    assert page_of(*files, tmp_path / "page.html").count("(12 parts)") == page.count("(12 parts)")


def test_what_was_flown_one_after_the_other_stays_apart(tmp_path):
    folder = tmp_path / "flights"
    for k, start in enumerate((0.0, 30.0, 60.0)):  # numbered by their pilot
        write_part(folder / f"run_{k}.bag", start)
    write_part(folder / "flight_2026-11-28-07-00-00_0.bag", 100.0)
    write_part(folder / "flight_2026-11-28-07-00-05_1.bag", 105.0)
    write_part(folder / "flight_2026-11-28-07-00-30_0.bag", 130.0)
    write_part(folder / "flight_2026-11-28-07-00-35_1.bag", 135.0)
    write_part(folder / "flight_2026-11-28-07-00-45_3.bag", 145.0)  # the one between them is lost
    page = page_of(folder, tmp_path / "page.html")
    assert "<h1>6 flights compared</h1>" in page
    assert set(re.findall(r"([\w-]+\.bag)(?: \((\d) parts\))?<", page)) >= {
        ("flight_2026-11-28-07-00-00_0.bag", "2"),
        ("flight_2026-11-28-07-00-30_0.bag", "2"),
        ("flight_2026-11-28-07-00-45_3.bag", ""),
    }


def test_folders_are_repetitions_and_give_intervals(tmp_path):
    for k in range(3):
        write(tmp_path / "before" / str(k) / "flight.bag", higher=0.1 * k)
        write(tmp_path / "after" / str(k) / "flight.bag", higher=50.0 + 0.1 * k)
    page = page_of(tmp_path / "before", tmp_path / "after", tmp_path / "page.html")
    row = re.findall(r"<tr><td>climb</td>.*?</tr>", page)[-1]
    assert "<td class=n>50</td>" in row
    assert re.search(r"49\.\d+ to 50\.\d+", row)
    assert "differs" in row


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{a}"], "one flight alone"),
        (["{a}", "{none}"], "No such file"),
        (["{a}", "{empty}"], "a folder without any .bag file"),
        (["{a}", "{b}", "--event", "flutter"], "no event with 'flutter' in it; it has: aileron stuck"),
        (["{a}", "{b}", "--match", "scenario"], "give --match time or --event TEXT"),
        (["{a}", "{b}", "--match", "time", "--event", "x"], "give one of them"),
        (["{a}", "{b}", "-o", "/dev/null/page.html"], "/dev/null"),
    ],
)
def test_what_cannot_be_compared_is_said(tmp_path, capsys, arguments, message):
    files = {name: write(tmp_path / f"{name}.bag", played=False) for name in "ab"}
    files["none"], files["empty"] = tmp_path / "none.bag", tmp_path / "empty"
    files["empty"].mkdir()
    assert compare_flights.main([word.format(**files) for word in arguments]) == 1
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        '{"begin": [1]}',
        '{"begin": {"epoch": 1}, "labels": {}}',
        '{"begin": {"epoch": 1, "sim_time_unwrapped": 1.0}}',
        '{"begin": {"epoch": 1, "sim_time_unwrapped": 1.0}, "labels": {}, "finished": true}',
    ],
)
def test_what_is_no_log_of_a_player_is_said(tmp_path, capsys, text):
    files = [write(tmp_path / f"{name}.bag", played=False) for name in "ab"]
    (tmp_path / "played.json").write_text(text)
    assert compare_flights.main([*map(str, files), "-o", str(tmp_path / "page.html")]) == 1
    err = capsys.readouterr().err
    assert f"{tmp_path / 'played.json'}: no log of a scenario's player; expected that of run_scenario, or none: " in err
    assert err.count("\n") == 1


def test_a_browser_shows_every_figure_without_an_error(tmp_path):
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    a, b = write(tmp_path / "a.bag"), write(tmp_path / "b.bag", higher=5.0)
    output = tmp_path / "page.html"
    page_of(a, b, output)
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}/profile"]
    shown = subprocess.run(
        [*command, "--virtual-time-budget=20000", "--dump-dom", output.as_uri()],
        capture_output=True, text=True, check=True, timeout=300,
    )  # fmt: skip
    assert 'data-linked="5"' in shown.stdout
    assert shown.stdout.count("main-svg") >= 5
    assert "Uncaught" not in shown.stderr
