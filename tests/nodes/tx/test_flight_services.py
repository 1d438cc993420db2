"""Flight services of tx_node, accepted, with the outcome on `events`; and what the simulator does by itself."""

from __future__ import annotations

import contextlib
import math
import signal
import socket
import struct
import threading
import time

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import ROLL, CommandSource, WatchedDatarefs, call, journal_entries, pause, tx_params
from xplane_bridge import protocol
from xplane_bridge.emulator.simulator import aircraft_path
from xplane_bridge.harness import wait_until

ACCEPTED, REFUSED, NOT_SUPPORTED, NO_LINK = 1, 2, 3, 4
RESET, CRASH, AIRCRAFT, PAUSE, SITUATION, SETTING = 1, 2, 3, 4, 10, 11
POSITION = "sim/flightmodel/position/"
WEIGHT = "sim/flightmodel/weight/"
STICK = "sim/joystick/yoke_roll_ratio"
OVERRIDE = "sim/operation/override/override_joystick_roll"
CG = "sim/flightmodel/misc/cgz_ref_to_default"
WIND = {
    11: ("sim/weather/wind_speed_kt", "sim/weather/wind_direction_degt"),
    12: ("sim/weather/aircraft/wind_now_speed_msc", "sim/weather/aircraft/wind_now_direction_degt"),
}
HERE = {"latitude": 47.2, "longitude": 8.3, "altitude_msl": 1500.0, "heading_true_deg": 250.0, "true_airspeed": 75.0}


def fly(world, version="11", **params):
    """Starts emulator (its own pilot flies level) and tx_node."""
    from xplane_bridge.msg import EventList

    pilot = world.folder / "pilot.yaml"
    pilot.write_text("name: level\nevents: [{at: 0, hold: {roll: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8")
    options = ("--no-beacon", "--start", "air", "--pilot", pilot, "--version", version)
    world.version = int(version.split(".")[0])
    world.xplane = world.emulator(*options)
    world.other = world.wire(world.xplane.port)
    world.seen = WatchedDatarefs(world.xplane.port, OVERRIDE, STICK)
    world.events = world.watch("events", EventList)
    world.manual = CommandSource(world, "control/manual")
    world.set_param("aircraft", "fixed_wing")
    world.set_param("stale_after", 5.0)  # late frames are no lost link
    world.node = world.start("tx_node", tx_params(**params))
    world.events.wait_for(lambda e: any(event.kind == AIRCRAFT for event in e.events))
    return world


def close(world):
    world.manual.stop()
    world.seen.close()
    world.close()


@pytest.fixture(scope="module", params=["11.40", "12"])
def flight(request, new_world, tmp_path_factory):
    """One flight of each X-Plane, that many tests share."""
    world = fly(new_world(tmp_path_factory.mktemp("services")), request.param, setting_timeout=10.0, load_timeout=30.0)
    yield world
    close(world)


@pytest.fixture(scope="module", params=["11.40", "12"])
def impatient(request, new_world, tmp_path_factory):
    """The same, of tests that wait for tx_node to give up."""
    world = fly(new_world(tmp_path_factory.mktemp("impatient")), request.param, setting_timeout=5.0, load_timeout=5.0)
    yield world
    close(world)


@pytest.fixture(scope="module")
def menu(new_world, tmp_path_factory):
    """A flight in whose simulator another client does things."""
    world = fly(new_world(tmp_path_factory.mktemp("menu")))
    yield world
    close(world)


def ask(world, service, kind, **request):
    """Calls a flight service that accepts; returns the event with the outcome."""
    response = call(world, service, kind, **request)
    assert (response.success, response.result.code) == (True, ACCEPTED), response.result.message
    number = response.event_number
    assert str(number) in response.result.message
    reported = world.events.wait_for(lambda e: any(event.number == number for event in e.events), WAIT_S)
    return next(event for event in reported.events if event.number == number)


def done(world, service, kind, **request):
    """The same, and X-Plane did it."""
    event = ask(world, service, kind, **request)
    assert event.success, event.text
    assert event.requested_by.endswith("/" + service)
    return event


def test_reset_of_a_paused_flight_is_exact_and_leaves_it_paused(flight):
    done(flight, "set_wind", "SetWind", speed=10.0, from_deg=160.0)
    pause(flight, True)
    event = done(
        flight,
        "reset_flight",
        "ResetFlight",
        **{**HERE, "roll_deg": 20.0, "pitch_deg": 3.0, "flight_path_angle_deg": -2.0},
    )
    assert event.kind == RESET
    assert flight.other.read("sim/time/paused") == 1.0
    at = {name: flight.other.read(POSITION + name) for name in ("true_phi", "true_theta", "true_psi", "elevation")}
    assert at == pytest.approx({"true_phi": 20.0, "true_theta": 3.0, "true_psi": 250.0, "elevation": 1500.0}, abs=0.01)
    assert flight.other.read(POSITION + "latitude") == pytest.approx(47.2, abs=1e-5)
    assert flight.other.read(POSITION + "longitude") == pytest.approx(8.3, abs=1e-5)
    # Through the air 75 m/s, 2 deg down, towards 250 deg; 10 m/s from 160 deg blow to 340 deg, across.
    assert flight.other.read(POSITION + "groundspeed") == pytest.approx(math.hypot(74.954, 10.0), abs=0.02)
    assert flight.other.read(POSITION + "true_airspeed") == pytest.approx(75.0, abs=0.02)
    assert flight.other.read(POSITION + "vh_ind") == pytest.approx(-2.617, abs=0.02)
    assert [flight.other.read(POSITION + rate) for rate in ("Prad", "Qrad", "Rrad")] == pytest.approx(
        [0.0] * 3, abs=1e-3
    )
    pause(flight, False)
    done(flight, "set_wind", "SetWind", speed=0.0, from_deg=360.0)


def test_reset_of_a_running_flight_flies_on_from_there(flight):
    flight.events.skip_to_now()
    time = flight.other.read("sim/time/total_running_time_sec")
    done(flight, "reset_flight", "ResetFlight", **{**HERE, "latitude": 46.9, "altitude_msl": 900.0})
    assert flight.other.read("sim/time/paused") == 0.0
    assert flight.other.read(POSITION + "latitude") == pytest.approx(46.9, abs=0.01)
    assert flight.other.read(POSITION + "elevation") == pytest.approx(900.0, abs=30.0)
    assert flight.other.read("sim/time/total_running_time_sec") > time
    # The pause of the reset is reported as its own, and no reset by another client.
    since = [event for event in flight.events.last.events if event.sim_time >= time - 1e-3]
    paused = [(event.text, event.requested_by.rsplit("/", 1)[-1]) for event in since if event.kind == PAUSE]
    assert paused == [("paused", "reset_flight"), ("resumed", "reset_flight")]
    assert [event.requested_by != "" for event in since if event.kind == RESET] == [True]


def test_wind_blows(flight):
    assert done(flight, "set_wind", "SetWind", speed=12.0, from_deg=250.0).kind == SETTING
    speed, direction = WIND[flight.version]
    assert flight.other.read(speed) == pytest.approx(12.0, abs=0.1)
    assert flight.other.read(direction) == pytest.approx(250.0, abs=1.0)
    done(flight, "reset_flight", "ResetFlight", **HERE)  # into the wind
    air = flight.other.read(POSITION + "true_airspeed")
    assert air - flight.other.read(POSITION + "groundspeed") == pytest.approx(12.0, abs=1.0)
    assert done(flight, "set_wind", "SetWind", speed=8.0, from_deg=20.0, turbulence=0.5)
    assert done(flight, "set_wind", "SetWind", speed=0.0, from_deg=360.0)


SEA_LEVEL = {  # temperature [deg C], pressure in X-Plane's unit and Pa of one of these
    11: ("sim/weather/temperature_sealevel_c", "sim/weather/barometer_sealevel_inhg", 3386.389),
    12: ("sim/weather/region/sealevel_temperature_c", "sim/weather/region/sealevel_pressure_pas", 1.0),
}


def test_time_is_set_and_runs_on(flight):
    # DATE | ZULU_TIME
    assert done(flight, "set_time", "SetTime", fields=3, date_days=10, zulu_time=30000.0).kind == SETTING
    assert flight.other.read("sim/time/local_date_days") == 10.0
    assert 30000.0 <= flight.other.read("sim/time/zulu_time_sec") < 30060.0
    done(flight, "set_time", "SetTime", fields=4, time_ratio=2)
    assert flight.other.read("sim/time/sim_speed") == 2.0
    done(flight, "set_time", "SetTime", fields=4, time_ratio=1)


def test_weather_is_set_and_flown_in(flight):
    temperature, pressure, unit = SEA_LEVEL[flight.version]
    before = flight.other.read("sim/weather/rho")
    # WIND | VISIBILITY | TEMPERATURE | PRESSURE
    event = done(
        flight,
        "set_weather",
        "SetWeather",
        fields=1 + 4 + 16 + 32,
        wind_layer_altitude=[0.0, 2000.0],
        wind_layer_from_deg=[90.0, 120.0],
        wind_layer_speed=[11.0, 20.0],
        visibility=8000.0,
        sea_level_temperature=40.0,
        sea_level_pressure=98000.0,
    )
    assert event.text == "the weather is set as asked for"
    assert flight.other.read(temperature) == pytest.approx(40.0, abs=1e-3)
    assert flight.other.read(pressure) * unit == pytest.approx(98000.0, abs=1.0)
    # By the ideal gas, pressure and temperature at the same height shrink alike: 98000/101325 * 288.15/313.15 = 0.890.
    assert flight.other.read("sim/weather/rho") / before == pytest.approx(0.890, abs=0.02)
    speed, direction = WIND[flight.version]
    assert flight.other.read(speed) == pytest.approx(11.0, abs=0.1)
    assert flight.other.read(direction) == pytest.approx(90.0, abs=1.0)
    clouds = {"cloud_base": [900.0], "cloud_top": [1500.0], "cloud_cover": [0.5]}
    done(flight, "set_weather", "SetWeather", fields=2, cloud_type=[2], **clouds)
    layers = {11: 3, 12: 13}[flight.version] + 1
    many = {name: [float(k) for k in range(layers)] for name in ("from_deg", "speed", "altitude")}
    event = ask(flight, "set_weather", "SetWeather", fields=1, **{f"wind_layer_{k}": v for k, v in many.items()})
    assert not event.success
    assert f"layers of wind: {layers} are given" in event.text
    done(flight, "set_weather", "SetWeather", fields=48, sea_level_temperature=15.0, sea_level_pressure=101325.0)
    done(flight, "set_wind", "SetWind", speed=0.0, from_deg=360.0)


def test_loading_changes_weight_and_balance(flight):
    nan = math.nan
    done(flight, "set_loading", "SetLoading", fuel_tank=[100.0, 100.0], payload_mass=200.0, cg_offset=0.0)
    before = flight.other.read(WEIGHT + "m_total")
    done(flight, "set_loading", "SetLoading", fuel_tank=[60.0, 70.0], payload_mass=nan, cg_offset=nan)
    assert flight.other.read(WEIGHT + "m_total") == pytest.approx(before - 70.0, abs=1.0)
    done(flight, "set_loading", "SetLoading", payload_mass=250.0, cg_offset=0.05)
    assert flight.other.read(WEIGHT + "m_total") == pytest.approx(before - 20.0, abs=1.0)
    assert flight.other.read(CG) == pytest.approx(0.05, abs=0.002)
    assert flight.other.read(WEIGHT + "m_fixed") == pytest.approx(250.0, abs=0.1)
    if flight.version == 12:  # half of it elsewhere: as it is spread stays as it is
        flight.other.send(*(protocol.DrefWrite(f"{WEIGHT}m_stations[{i}]", 125.0) for i in (0, 3)))
        flight.other.wait_until_reads(WEIGHT + "m_stations[3]", 125.0)
        done(flight, "set_loading", "SetLoading", payload_mass=200.0, cg_offset=nan)
        assert flight.other.read(WEIGHT + "m_stations[3]") == pytest.approx(100.0, abs=0.1)
        done(flight, "set_loading", "SetLoading", payload_mass=250.0, cg_offset=nan)
    done(flight, "set_loading", "SetLoading", fuel_tank=[100.0, 100.0], payload_mass=210.0, cg_offset=0.0)


def test_a_saved_state_comes_back(flight):
    path = "Output/situations/test.sit"
    done(flight, "reset_flight", "ResetFlight", **HERE)
    done(flight, "set_loading", "SetLoading", fuel_tank=[80.0, 90.0], payload_mass=math.nan, cg_offset=math.nan)
    event = done(flight, "save_state", "Situation", path=path)
    assert event.kind == SITUATION
    assert "does not show whether it did" in event.text
    done(flight, "set_loading", "SetLoading", fuel_tank=[20.0, 20.0], payload_mass=math.nan, cg_offset=math.nan)
    done(flight, "reset_flight", "ResetFlight", **{**HERE, "latitude": 46.5, "altitude_msl": 3000.0})
    assert done(flight, "load_state", "Situation", path=path).kind == SITUATION
    assert flight.other.read(POSITION + "latitude") == pytest.approx(47.2, abs=0.02)
    assert flight.other.read(POSITION + "elevation") == pytest.approx(1500.0, abs=60.0)
    assert flight.other.read(WEIGHT + "m_fuel[1]") == pytest.approx(90.0, abs=1.0)


def test_what_cannot_be_is_refused(flight):
    def refusal(service, kind, **request):
        response = call(flight, service, kind, **request)
        assert (response.success, response.result.code, response.event_number) == (False, REFUSED, 0)
        return response.result.message

    assert "latitude is 95: expected -89.9..89.9" in refusal("reset_flight", "ResetFlight", latitude=95.0)
    assert "true_airspeed is nan" in refusal("reset_flight", "ResetFlight", true_airspeed=math.nan)
    assert "speed is -1: expected 0..100 [m/s]" in refusal("set_wind", "SetWind", speed=-1.0)
    nothing = refusal("set_loading", "SetLoading", payload_mass=math.nan, cg_offset=math.nan)
    assert "expected fuel_tank, payload_mass or cg_offset" in nothing
    uneven = refusal("set_weather", "SetWeather", fields=1, wind_layer_altitude=[0.0, 500.0], wind_layer_speed=[5.0])
    assert "wind_layer_from_deg has 0 values: expected 2, one a layer" in uneven
    for service, kind, words in (  # what a request without a word asks for
        ("reset_flight", "ResetFlight", "no place is given"),
        ("set_wind", "SetWind", "nothing is given"),
        ("set_loading", "SetLoading", "nothing is given"),
        ("set_time", "SetTime", "nothing is given"),
        ("set_weather", "SetWeather", "nothing is given"),
        ("load_aircraft", "LoadAircraft", "is empty"),
        ("load_state", "Situation", "is empty"),
        ("save_state", "Situation", "is empty"),
    ):
        assert words in refusal(service, kind)
    assert "is absolute: expected a file relative" in refusal("load_aircraft", "LoadAircraft", path="/a/b.acf")
    assert "livery is -1" in refusal("load_aircraft", "LoadAircraft", path="a/b.acf", livery=-1)
    assert "does not end in .sit" in refusal("save_state", "Situation", path="Output/a.acf")
    assert "is empty" in refusal("load_state", "Situation", path="")


def test_aircraft_is_loaded_and_flown_only_if_it_is_the_one_configured(flight):
    flight.manual.fly(fields=ROLL, roll=0.25)
    flight.seen.wait(OVERRIDE, 1.0)
    flight.seen.wait(STICK, 0.25)
    event = done(flight, "load_aircraft", "LoadAircraft", path=aircraft_path("multirotor"))
    assert event.kind == AIRCRAFT
    assert "QUAD" in event.text
    texts = [e.text for e in flight.events.last.events]
    given = max(i for i, text in enumerate(texts) if text == "overrides: gave back override_joystick_roll")
    assert given < next(i for i, text in enumerate(texts) if text.startswith("aircraft: QUAD")), "before it was loaded"
    assert flight.seen.value(OVERRIDE) == 0.0
    assert "override:" + OVERRIDE not in journal_entries(flight)
    flight.wait_for_diagnostics("control", lambda s: "QUAD" in s.message)
    reported = [e for e in flight.events.last.events if e.kind == AIRCRAFT and "not the one of the" in e.text]
    assert reported[-1].requested_by.endswith("/load_aircraft")
    done(flight, "load_aircraft", "LoadAircraft", path=aircraft_path("fixed_wing"))
    flight.seen.wait(OVERRIDE, 1.0)
    flight.seen.wait(STICK, 0.25)
    # The same once more: loaded anew.
    done(flight, "load_aircraft", "LoadAircraft", path=aircraft_path("fixed_wing"))
    flight.seen.wait(OVERRIDE, 1.0)
    flight.manual.stop()


def test_wind_that_does_not_blow_is_reported(impatient):
    done(impatient, "set_wind", "SetWind", speed=12.0, from_deg=270.0)
    pause(impatient, True)
    event = ask(impatient, "set_wind", "SetWind", speed=30.0, from_deg=0.0)
    assert not event.success
    assert "12.0" in event.text
    assert "(it is paused)" in event.text
    pause(impatient, False)
    done(impatient, "set_wind", "SetWind", speed=0.0, from_deg=360.0)


def test_fuel_without_a_tank_is_reported(impatient):
    nan = math.nan
    event = ask(impatient, "set_loading", "SetLoading", fuel_tank=[60.0, 70.0, 5.0], payload_mass=nan, cg_offset=nan)
    assert not event.success
    assert "m_fuel[2] is 0.0" in event.text


@pytest.mark.parametrize("impatient", ["11.40"], indirect=True)  # it waits for two time-outs
def test_files_that_are_not_there_are_reported(impatient):
    impatient.manual.fly(fields=ROLL, roll=0.125)
    impatient.seen.wait(STICK, 0.125)
    event = ask(impatient, "load_aircraft", "LoadAircraft", path="Aircraft/missing/built.acf")
    assert not event.success
    assert "is the path that of a file below its folder?" in event.text
    impatient.seen.wait(OVERRIDE, 1.0)  # the present one is flown on
    impatient.seen.wait(STICK, 0.125)
    impatient.manual.stop()
    event = ask(impatient, "load_state", "Situation", path="Output/situations/never_saved.sit")
    assert not event.success
    assert "the flight goes on as it was" in event.text


def test_reset_to_where_x_plane_does_not_put_it_is_reported(impatient):
    event = ask(impatient, "reset_flight", "ResetFlight", **{**HERE, "altitude_msl": -400.0})
    assert not event.success
    assert "its altitude is" in event.text
    assert impatient.other.read("sim/time/paused") == 0.0
    done(impatient, "reset_flight", "ResetFlight", **HERE)


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL], ids=["asked", "killed"])
def test_weather_that_was_to_end_with_the_node_does(world, end):
    temperature = SEA_LEVEL[11][0]
    fly(world)
    try:
        done(world, "set_weather", "SetWeather", fields=16, sea_level_temperature=30.0, restore_on_exit=True)
        assert world.other.read(temperature) == pytest.approx(30.0)
        world.node.send_signal(end)
        wait_until(lambda: abs(world.other.read(temperature) - 15.0) < 1e-3, WAIT_S, "the temperature of before")
    finally:
        close(world)


def test_without_x_plane_nothing_is_accepted(world):
    from xplane_bridge import srv

    world.point_to(9)  # no X-Plane there
    world.set_param("aircraft", "fixed_wing")
    world.start("tx_node", tx_params())
    for service, kind, request in (
        ("reset_flight", "ResetFlight", HERE),
        ("set_wind", "SetWind", {"speed": 5.0}),
        ("load_aircraft", "LoadAircraft", {"path": "a/b.acf"}),
    ):
        response = world.call(f"tx_node/{service}", getattr(srv, kind), **request)
        assert (response.success, response.result.code) == (False, NO_LINK)


class XPlane10:
    """Answers what it is asked, and says that it is X-Plane 10."""

    def __init__(self):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.02)
        self.port = self._socket.getsockname()[1]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._answer, daemon=True)
        self._thread.start()

    def _answer(self):
        asked = {}
        while not self._ended.is_set():
            with contextlib.suppress(socket.timeout):
                datagram, sender = self._socket.recvfrom(65536)
                if datagram[:4] == b"RREF":
                    _, index = struct.unpack_from("<ii", datagram, 5)
                    asked[sender, index] = datagram[13:].split(b"\0")[0]
            values = {b"sim/version/xplane_internal_version": 105105.0}
            values[b"sim/time/total_running_time_sec"] = time.monotonic() % 1000.0
            for (client, index), path in list(asked.items()):
                self._socket.sendto(b"RREFO" + struct.pack("<if", index, values.get(path, 0.0)), client)

    def close(self):
        self._ended.set()
        self._thread.join(5)
        self._socket.close()


def test_x_plane_10_is_not_supported_and_why(world):
    old = XPlane10()
    world.point_to(old.port)
    world.set_param("aircraft", "fixed_wing")
    world.start("tx_node", tx_params())

    def not_supported():
        response = call(world, "set_wind", "SetWind", speed=5.0)
        assert not response.success
        return response.result.message if response.result.code == NOT_SUPPORTED else ""

    message = wait_until(not_supported, WAIT_S, "the version to be known")
    assert "this is X-Plane 105105" in message
    assert "before 11.00" in message
    old.close()


# --- in the simulator's own menu ---


def wait_for_event(world, kind, text=""):
    """Waits for an event after those looked at before; none of the bridge's own."""
    event = world.events.then_wait_for_event(lambda event: event.kind == kind and text in event.text, what=text)
    assert event.requested_by == ""
    return event


def test_pause_by_another_client_is_reported(menu):
    menu.events.skip_to_now()
    menu.other.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wait_for_event(menu, PAUSE, "paused")
    menu.other.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    wait_for_event(menu, PAUSE, "resumed")


def test_pause_by_service_is_reported_with_its_name(menu):
    menu.events.skip_to_now()
    pause(menu, True)
    reported = menu.events.then_wait_for_event(lambda event: event.kind == PAUSE)
    assert (reported.text, reported.requested_by.rsplit("/", 1)[-1]) == ("paused", "pause")
    pause(menu, False)
    menu.events.then_wait_for_event(lambda event: event.text == "resumed")


def test_reset_by_another_client_is_reported(menu):
    menu.events.skip_to_now()
    menu.other.send(protocol.CommandRequest("sim/operation/reset_flight"))
    wait_for_event(menu, RESET, "the flight began anew")


def test_placement_and_situation_by_another_client_are_reported(menu):
    menu.other.send(protocol.Situation(protocol.Situation.SAVE, "Output/situations/mine.sit"))
    menu.events.skip_to_now()
    menu.other.send(protocol.DrefWrite(POSITION + "local_y", 2500.0))
    wait_for_event(menu, RESET, "the aircraft was placed")
    menu.other.send(protocol.Situation(protocol.Situation.LOAD, "Output/situations/mine.sit"))
    wait_for_event(menu, RESET)


def test_crash_is_reported_and_its_reset(menu):
    menu.events.skip_to_now()
    lower = menu.other.read(POSITION + "y_agl") - 30.0
    menu.other.send(protocol.DrefWrite(POSITION + "local_y", menu.other.read(POSITION + "local_y") - lower))
    wait_for_event(menu, RESET, "placed")
    menu.other.send(protocol.DrefWrite(POSITION + "local_vy", -60.0))
    wait_for_event(menu, CRASH, "crashed")
    done(menu, "reset_flight", "ResetFlight", **HERE)
    assert menu.other.read("sim/flightmodel2/misc/has_crashed") == 0.0


def test_aircraft_by_another_client_is_reported_and_not_flown(menu):
    menu.manual.fly(fields=ROLL, roll=0.25)
    menu.seen.wait(OVERRIDE, 1.0)
    menu.events.skip_to_now()
    menu.other.send(protocol.AircraftLoad(0, aircraft_path("multirotor")))
    reported = menu.events.then_wait_for_event(lambda event: event.kind == AIRCRAFT)
    assert "QUAD" in reported.text
    assert reported.requested_by == ""
    menu.seen.wait(OVERRIDE, 0.0)
    menu.manual.stop()
