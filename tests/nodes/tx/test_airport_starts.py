"""reset_flight at an airport: the emulator's, on the equator, where every degree is 111320 m long."""

from __future__ import annotations

import math

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import call, journal_entries, tx_params
from xplane_bridge.harness import wait_until

ACCEPTED, REFUSED = 1, 2
RAMP, RUNWAY, FINAL = 1, 2, 3
METERS_PER_DEG = 111319.6
POSITION = "sim/flightmodel/position/"
#: The emulator's aerodrome as X-Plane's file would have it; its runway is 1800 m long. XXXX it does not have.
AIRPORT_DATA = """I
1100 Version

1 0 0 0 XXXX Nowhere
1300 50.0 10.0 0.0 misc all Apron
1 0 0 0 XEMU The emulator's
100 45.00 1 0 0.25 1 2 1 09 0.0 9.991915 0 0 3 0 0 0 27 0.0 10.008085 0 0 3 0 0 0
1300 -0.001347 10.0 0.0 misc all Main Apron
99
"""


@pytest.fixture(scope="module", params=["11.40", "12"])
def flight(request, new_world, tmp_path_factory):
    """One flight of each X-Plane, that the tests share."""
    from xplane_bridge.msg import EventList

    world = new_world(tmp_path_factory.mktemp("airport"))
    world.xplane = world.emulator(
        "--no-beacon", "--lat", "0", "--lon", "10", "--heading", "90", "--version", request.param
    )
    world.other = world.wire(world.xplane.port)
    world.events = world.watch("events", EventList)
    data = world.folder / "apt.dat"
    data.write_text(AIRPORT_DATA, encoding="utf-8")
    world.set_param("aircraft", "fixed_wing")
    world.start("tx_node", tx_params(airport_data=str(data), setting_timeout=10.0, load_timeout=15.0))
    world.events.wait_for(lambda e: any(event.kind == event.AIRCRAFT for event in e.events), 60)
    yield world
    world.close()


def ask(world, **request):
    """Calls the service, which accepts; returns the event with the outcome."""
    flies = "sim/time/total_flight_time_sec"
    wait_until(lambda: world.other.read(flies) > 1.0, WAIT_S, "a flight that has begun")
    response = call(world, "reset_flight", "ResetFlight", **request)
    assert (response.success, response.result.code) == (True, ACCEPTED), response.result.message
    number = response.event_number
    reported = world.events.wait_for(lambda e: any(event.number == number for event in e.events), 60)
    return next(event for event in reported.events if event.number == number)


def where(world):
    """Metres east and north of the runway's middle, true heading [deg]."""
    east = (world.other.read(POSITION + "longitude") - 10.0) * METERS_PER_DEG
    north = world.other.read(POSITION + "latitude") * METERS_PER_DEG
    return east, north, world.other.read(POSITION + "true_psi")


@pytest.mark.parametrize(
    ("request_", "text", "east", "north", "heading"),
    [
        ({"start": RAMP}, "ramp 0 of XEMU", 0.0, -150.0, 0.0),
        ({"start": RUNWAY}, "runway 0, end 0 of XEMU", -840.0, 0.0, 90.0),
        ({"start": RUNWAY, "runway_end": 1}, "runway 0, end 1 of XEMU", 840.0, 0.0, 270.0),
        ({"start": RUNWAY, "spot": "27"}, "runway 27 of XEMU", 840.0, 0.0, 270.0),
        ({"start": RAMP, "spot": "Main Apron"}, "ramp Main Apron of XEMU", 0.0, -150.0, 0.0),
    ],
)
def test_aircraft_stands_where_it_was_asked_for(flight, request_, text, east, north, heading):
    event = ask(flight, airport="XEMU", **request_)
    assert event.success, event.text
    assert (event.kind, event.text) == (event.RESET, f"the flight begins at {text}")
    assert event.requested_by.endswith("/reset_flight")
    x, y, shown = where(flight)
    assert (x, y) == (pytest.approx(east, abs=5.0), pytest.approx(north, abs=5.0))
    assert math.remainder(shown - heading, 360.0) == pytest.approx(0.0, abs=1.0)
    assert flight.other.read("sim/flightmodel/failures/onground_any") == 1.0
    assert flight.other.read("sim/time/paused") == 0.0
    assert not [entry for entry in journal_entries(flight) if entry.startswith("pause:")]


def test_final_is_on_the_glide_path_and_flies_on(flight):
    event = ask(
        flight, start=FINAL, airport="XEMU", spot="09", final_distance=6000.0, true_airspeed=60.0, pitch_deg=1.0
    )
    assert event.success, event.text
    assert event.text == "the flight goes on 6000 m before runway 09 of XEMU"
    x, y, heading = where(flight)
    # It has flown on since: at 60 m/s, for a few seconds at most.
    assert -6850.0 < x < -5500.0
    assert y == pytest.approx(0.0, abs=50.0)
    assert heading == pytest.approx(90.0, abs=10.0)
    # 15 m, 6 km of 3 deg (314.4 m) and the aircraft's own height, less what it has come down at 3 m/s.
    assert 250.0 < flight.other.read(POSITION + "y_agl") < 340.0
    assert flight.other.read("sim/flightmodel/failures/onground_any") == 0.0


def test_what_x_plane_does_not_have_is_reported(flight):
    event = ask(flight, start=RAMP, airport="RKSI")
    assert (event.kind, event.success) == (event.RESET, False)
    assert "X-Plane begins no flight at ramp 0 of RKSI: does it have that airport" in event.text
    event = ask(flight, start=RUNWAY, airport="XEMU", spot_index=3)
    assert "X-Plane begins no flight at runway 3, end 0 of XEMU" in event.text
    event = ask(flight, start=RUNWAY, airport="XEMU", spot="33L")
    assert 'XEMU has no runway "33L", but 09, 27' in event.text
    event = ask(flight, start=RAMP, airport="XXXX", spot="Apron")
    assert "X-Plane begins no flight at ramp Apron of XXXX" in event.text
    assert flight.other.read("sim/time/paused") == 0.0


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"start": 4}, "start is 4: expected 0 (PLACE), 1 (RAMP), 2 (RUNWAY) or 3 (FINAL)"),
        ({"start": RAMP}, 'airport is "": expected an ICAO code'),
        ({"start": RAMP, "airport": "XEMU", "latitude": 1.0}, "latitude does not go with start 1"),
        ({"start": RUNWAY, "airport": "XEMU", "true_airspeed": 50.0}, "true_airspeed does not go with start 2"),
        ({"start": FINAL, "airport": "XEMU", "true_airspeed": 50.0}, "final_distance is 0: expected 500..50000 [m]"),
        ({"airport": "XEMU", "latitude": 1.0}, "airport does not go with start 0 (PLACE)"),
    ],
)
def test_impossible_requests_are_refused(flight, request_, words):
    response = call(flight, "reset_flight", "ResetFlight", **request_)
    assert (response.success, response.result.code) == (False, REFUSED)
    assert words in response.result.message
