"""Who moves what in the emulator: overrides, DATA rows, failures."""

from __future__ import annotations

import math

import pytest

from support.simulator.emulator_bench import (
    OVERRIDE,
    POSITION,
    YOKE_PITCH,
    YOKE_ROLL,
    fixture_bench,  # noqa: F401
    row,
)
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState

THROTTLE = "sim/cockpit2/engine/actuators/throttle_ratio"
THRO_USE = "sim/flightmodel/engine/ENGN_thro_use"
LEFT_AILERON = "sim/flightmodel/controls/wing2l_ail1def"
RIGHT_AILERON = "sim/flightmodel/controls/wing2r_ail1def"
ELEVATOR = "sim/flightmodel/controls/hstab1_elv1def"
RUDDER = "sim/flightmodel/controls/vstab1_rud1def"
FAILURES = "sim/operation/failures/"


def test_a_lever_in_reverse_is_below_0_by_one_name_and_above_by_the_other(bench):
    emulator = bench()
    reverse, mode = "sim/cockpit2/engine/actuators/throttle_jet_rev_ratio", "sim/flightmodel/engine/ENGN_propmode"
    emulator.write({reverse + "[0]": -0.5, reverse + "[1]": 0.25})
    shown = [f"{name}[{engine}]" for name in (reverse, THROTTLE, mode) for engine in (0, 1)]
    assert emulator.read(*shown) == [-0.5, 0.25, 0.5, 0.25, 3.0, 1.0]
    emulator.write({reverse + "_all": 0.75})
    assert emulator.read(*shown) == [0.75, 0.75, 0.75, 0.75, 1.0, 1.0]
    emulator.write({THROTTLE + "[0]": 0.5})
    assert emulator.read(*shown)[:3] == [0.5, 0.75, 0.5]


# --- the stick ---


@pytest.mark.parametrize("name", [YOKE_ROLL, "sim/cockpit2/controls/yoke_roll_ratio"])
def test_stick_obeys_the_yoke_datarefs_only_under_the_override(bench, name):
    emulator = bench()
    emulator.write({name: 0.5})
    emulator.step(30)
    assert emulator.sim.model.state.roll_rad == pytest.approx(0.0, abs=1e-9)
    assert emulator.read(YOKE_ROLL) == [0.0]
    emulator.write({OVERRIDE + "joystick": 1.0, name: 0.5})
    emulator.step(60)
    assert emulator.read(YOKE_ROLL, "sim/cockpit2/controls/yoke_roll_ratio") == [0.5, 0.5]
    assert math.degrees(emulator.sim.model.state.roll_rad) > 10.0


def test_stick_override_by_axis(bench):
    emulator = bench()
    emulator.write({OVERRIDE + "joystick_roll": 1.0, YOKE_ROLL: 0.5, YOKE_PITCH: 0.5})
    assert emulator.read(YOKE_ROLL, YOKE_PITCH) == [0.5, 0.0]


def test_without_a_joystick_the_stick_takes_writes_under_no_override(bench):
    centred, free = bench(), bench(joystick="none")
    for emulator in (centred, free):
        emulator.write({YOKE_ROLL: 0.5, "sim/cockpit2/controls/yoke_pitch_ratio": 0.25})
        emulator.step(30)
    assert centred.read(YOKE_ROLL, YOKE_PITCH) == [0.0, 0.0]
    assert free.read(YOKE_ROLL, YOKE_PITCH) == [0.5, 0.25]
    assert math.degrees(free.sim.model.state.roll_rad) > 5.0


@pytest.mark.parametrize(
    ("override", "stays"),
    [("", False), ("joystick", True), ("joystick_heading", True), ("joystick_roll", False)],
)
def test_overrides_stop_pedals_and_auto_coordination(bench, override, stays):
    emulator = bench(auto_coordination=True)
    emulator.sim.model.state.beta_rad = math.radians(3.0)
    emulator.write({OVERRIDE + "planepath": 1.0})  # the sideslip stands
    if override:
        emulator.write({OVERRIDE + override: 1.0})
    emulator.step(2)
    # nose to the wind: to the right when it comes from there
    assert emulator.read("sim/joystick/yoke_heading_ratio") == [pytest.approx(0.0 if stays else 0.3)]


def test_overrides_and_the_last_stick_outlive_the_client(bench):
    emulator = bench()
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.3})  # this client's socket is closed again
    emulator.step(300)
    assert emulator.read(OVERRIDE + "joystick", YOKE_ROLL) == [1.0, pytest.approx(0.3)]


@pytest.mark.parametrize("index", [8, 11])
def test_data_row_holds_the_stick_until_999(bench, index):
    emulator = bench()
    client = emulator.client()
    client.send(row(index, 0.1, -0.4))  # elevator, aileron; rudder untouched
    emulator.step(20)
    assert emulator.read(YOKE_PITCH, YOKE_ROLL) == [pytest.approx(0.1), pytest.approx(-0.4)]
    client.send(row(index, -999.0, -0.2))
    assert emulator.read(YOKE_PITCH, YOKE_ROLL) == [0.0, pytest.approx(-0.2)]
    client.send(row(index))
    assert emulator.read(YOKE_PITCH, YOKE_ROLL) == [0.0, 0.0]


def test_data_rows_of_state_are_not_honoured(bench):
    emulator = bench()
    client = emulator.client()
    client.send(protocol.DataPacket(tuple((index, (1.0,) * 8) for index in (16, 17, 18, 20, 21, 500, -3))))
    emulator.step()
    assert emulator.sim.model.state.latitude_deg == pytest.approx(37.46, abs=0.01)


def test_data_row_25_moves_the_levers_and_comes_back_as_its_own_echo(bench):
    emulator = bench()
    client = emulator.client()
    client.send(row(25, 0.2, 0.8))
    assert emulator.read(THROTTLE + "[0]", THROTTLE + "[1]") == [pytest.approx(0.2), pytest.approx(0.8)]
    client.send(protocol.NetworkTarget(64, "127.0.0.1", client.port, True))
    client.send(protocol.RowSelection("DSEL", (25, 26)))
    emulator.step(3)
    rows = protocol.decode_data(client.received()[-1]).as_dict()
    assert rows[25][:3] == (pytest.approx(0.2), pytest.approx(0.8), 0.0)
    assert rows[26][:2] == (pytest.approx(0.2), pytest.approx(0.8))


def test_data_rows_13_and_14_move_trims_flaps_gear_and_brakes(bench):
    emulator = bench()
    client = emulator.client()
    client.send(row(13, 0.1, -0.2, 0.3, 0.5, -999.0, -999.0, -0.5))
    client.send(row(14, 0.0, 0.6))
    controls = "sim/cockpit2/controls/"
    names = (
        "elevator_trim",
        "aileron_trim",
        "rudder_trim",
        "flap_ratio",
        "speedbrake_ratio",
        "gear_handle_down",
        "parking_brake_ratio",
    )
    values = emulator.read(*(controls + name for name in names))
    assert values == pytest.approx([0.1, -0.2, 0.3, 0.5, -0.5, 0.0, 0.6])


def test_handles_and_levers_stay_where_a_row_put_them_also_when_it_ends_within_the_frame(bench):
    emulator = bench()
    client = emulator.client()
    for index, *values in ((13, -999.0, -999.0, -999.0, 0.5), (25, 0.2)):
        client.send(row(index, *values))
        client.send(row(index))
    assert emulator.read("sim/cockpit2/controls/flap_ratio", THROTTLE + "[0]") == pytest.approx([0.5, 0.2])


@pytest.mark.parametrize(
    ("aircraft", "shown"), [("fixed_wing", [1 / 3, 2 / 3, 1.0, 1.0, 2 / 3]), ("multirotor", [0.0] * 5)]
)
def test_the_flap_handle_moves_by_the_notches_that_the_aircraft_has(bench, aircraft, shown):
    emulator = bench(aircraft=aircraft)
    client, seen = emulator.client(), []
    for command in ("flaps_down",) * 4 + ("flaps_up",):
        client.send(protocol.CommandRequest("sim/flight_controls/" + command))
        seen += emulator.read("sim/cockpit2/controls/flap_ratio")
    assert seen == pytest.approx(shown)


def test_toe_brakes_need_their_override(bench):
    emulator = bench(initial=InitialState(on_ground=True))
    brake = "sim/cockpit2/controls/left_brake_ratio"
    emulator.write({brake: 1.0})
    assert emulator.read(brake) == [0.0]
    emulator.write({OVERRIDE + "toe_brakes": 1.0, brake: 1.0})
    emulator.step(3)
    assert emulator.read(brake) == [1.0]


# --- surfaces and engines directly ---


def test_surface_override_freezes_every_surface(bench):
    emulator = bench()
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.5, YOKE_PITCH: 0.25})
    emulator.step(30)
    before = emulator.read(LEFT_AILERON, RIGHT_AILERON, ELEVATOR)
    assert before == pytest.approx([10.0, -10.0, -5.0])
    emulator.write({OVERRIDE + "control_surfaces": 1.0, YOKE_ROLL: -1.0, YOKE_PITCH: -1.0})
    emulator.step(30)
    assert emulator.read(LEFT_AILERON, RIGHT_AILERON, ELEVATOR) == before


@pytest.mark.parametrize(
    "name",
    [
        LEFT_AILERON,
        "sim/flightmodel/controls/lail1def",
        "sim/flightmodel2/wing/aileron1_deg[2]",
        "sim/flightmodel/controls/ail1_def[10]",
    ],
)
def test_one_surface_moves_alone_under_the_override_by_any_of_its_names(bench, name):
    emulator = bench()
    emulator.write({OVERRIDE + "control_surfaces": 1.0, name: 7.0})
    emulator.step(2)
    assert emulator.read(name, LEFT_AILERON, RIGHT_AILERON) == pytest.approx([7.0, 7.0, 0.0])
    emulator.step(60)
    assert emulator.read(LEFT_AILERON) == pytest.approx([7.0])
    assert math.degrees(emulator.sim.model.state.roll_rad) > 5.0
    emulator.write({OVERRIDE + "control_surfaces": 0.0})
    emulator.step(30)
    assert emulator.read(LEFT_AILERON) == pytest.approx([0.0])


def test_snapshot_written_in_the_frame_of_the_override_counts(bench):
    emulator = bench()
    emulator.write({LEFT_AILERON: 3.0, RIGHT_AILERON: -2.0, OVERRIDE + "control_surfaces": 1.0})
    emulator.step()
    assert emulator.read(LEFT_AILERON, RIGHT_AILERON) == pytest.approx([3.0, -2.0])


def test_surface_writes_without_the_override_are_gone_in_the_next_frame(bench):
    emulator = bench()
    emulator.write({LEFT_AILERON: 9.0})
    assert emulator.read(LEFT_AILERON) == [0.0]
    emulator.write({OVERRIDE + "control_surfaces": 1.0})
    emulator.step(2)
    assert emulator.read(LEFT_AILERON) == [0.0]


def test_engines_obey_thro_use_only_under_the_override(bench):
    emulator = bench()
    emulator.write({THRO_USE + "[0]": 0.9})
    emulator.step(2)
    lever = emulator.sim.controls.throttle[0]
    assert emulator.read(THRO_USE) == [pytest.approx(lever)]
    emulator.write({OVERRIDE + "throttles": 1.0, THRO_USE + "[0]": 0.9})
    emulator.step(5)
    assert emulator.read(THRO_USE + "[0]", THRO_USE + "[1]") == [pytest.approx(0.9), pytest.approx(lever)]
    emulator.write({OVERRIDE + "throttles": 0.0})
    emulator.step(2)
    assert emulator.read(THRO_USE) == [pytest.approx(lever)]
    emulator.write(
        {OVERRIDE + "throttles": 1.0}
    )  # a new override starts from what the engines have, not from the old one
    emulator.step(2)
    assert emulator.read(THRO_USE) == [pytest.approx(lever)]


def test_throttle_override_of_all_engines_is_released_by_minus_two(bench):
    emulator = bench()
    name = "sim/flightmodel/engine/ENGN_thro_override"
    emulator.write({name: 0.1})
    emulator.step(2)
    assert emulator.read(THRO_USE + "[0]", THRO_USE + "[1]") == [pytest.approx(0.1)] * 2
    emulator.write({name: -2.0})
    emulator.step(2)
    assert emulator.read(THRO_USE + "[1]") == [pytest.approx(emulator.sim.controls.throttle[1])]


def test_trims_move_the_surfaces_beside_the_stick(bench):
    """Laminar's totals are yoke, servos and stability augmentation; trims are terms of their own."""
    emulator = bench(aircraft="fixed_wing", initial=InitialState(on_ground=True))
    cockpit = "sim/cockpit2/controls/"
    emulator.write({cockpit + f"{trim}_trim": 0.5 for trim in ("aileron", "elevator", "rudder")})
    emulator.step(60)
    surfaces = (LEFT_AILERON, RIGHT_AILERON, ELEVATOR, RUDDER)
    assert emulator.read(*surfaces) == pytest.approx([2.25, -2.25, -6.3, 5.4])
    for name in (cockpit + "total_{}_ratio", "sim/joystick/artstab_{}_ratio"):
        assert emulator.read(*(name.format(axis) for axis in ("roll", "pitch", "heading"))) == [0.0, 0.0, 0.0]


def test_limits_of_trim_are_parts_of_the_travel_that_it_moves(bench):
    emulator = bench(aircraft="fixed_wing", initial=InitialState(on_ground=True))
    limits, trim = "sim/aircraft/controls/acf_", "sim/cockpit2/controls/elevator_trim"
    emulator.write({trim: 1.0})
    emulator.step(60)
    # 12.6 of 18 degrees up, of 13 down
    assert emulator.read(ELEVATOR, limits + "elev_up", limits + "max_trim_elev") == pytest.approx([-12.6, 18.0, 0.7])
    emulator.write({trim: -1.0})
    emulator.step(60)
    assert emulator.read(ELEVATOR, limits + "elev_dn", limits + "min_trim_elev") == pytest.approx(
        [12.6, 13.0, 12.6 / 13.0]
    )
    assert emulator.read(limits + "max_trim_ailn", limits + "max_trim_rudd") == pytest.approx([0.3, 0.4])


# --- failures ---


@pytest.mark.parametrize(
    ("switch", "running"),
    [
        ("sim/cockpit2/engine/actuators/ignition_key[0]", [0.0, 1.0]),
        ("sim/cockpit2/fuel/fuel_tank_selector", [0.0, 0.0]),
    ],
)
def test_a_switch_that_is_off_stops_its_engines(bench, switch, running):
    emulator = bench(aircraft="fixed_wing")
    engines = [f"sim/flightmodel/engine/ENGN_running[{engine}]" for engine in (0, 1)]
    (on,) = emulator.read(switch)
    emulator.write({switch: 0.0})
    assert emulator.read(*engines) == running
    emulator.write({switch: on})
    emulator.step(60)
    assert emulator.read(*engines) == [1.0, 1.0]  # the propeller turns it
    emulator.write({switch: 0.0})
    emulator.client().send(protocol.Placement(5))
    assert emulator.read(switch, *engines) == [on, 1.0, 1.0]  # another flight


def test_engine_failure_and_repair(bench):
    emulator = bench()
    running = "sim/flightmodel/engine/ENGN_running"
    emulator.write({FAILURES + "rel_engfai1": 6.0})
    emulator.step(2)
    assert emulator.read(running + "[0]", running + "[1]") == [1.0, 0.0]
    emulator.write({FAILURES + "rel_engfai1": 0.0})
    emulator.step(2)
    assert emulator.read(running + "[1]") == [1.0]


def test_a_failed_turbine_has_no_gas_generator_that_turns(bench):
    emulator = bench(aircraft="tiltrotor")
    names = [f"sim/flightmodel/engine/ENGN_{name}[{engine}]" for name in ("N1_", "N2_") for engine in (0, 1)]
    assert emulator.read(*names) == pytest.approx([89.0, 89.0, 100.0, 100.0], abs=0.5)
    emulator.write({FAILURES + "rel_engfai0": 6.0})
    emulator.step(60)
    # the other one drives both rotors through the joined shafts
    assert emulator.read(*names) == pytest.approx([0.0, 97.6, 100.0, 100.0], abs=0.5)


def test_a_failure_that_is_armed_for_later_does_nothing_yet(bench):
    emulator = bench()
    emulator.write({FAILURES + "rel_engfai0": 2.0})
    emulator.step(2)
    assert emulator.read(FAILURES + "rel_engfai0", "sim/flightmodel/engine/ENGN_running") == [2.0, 1.0]


@pytest.mark.parametrize("aircraft", ["kinematic", "fixed_wing", "tiltrotor"])
@pytest.mark.parametrize(
    ("failure", "handle", "shown", "frames"),
    [
        ("rel_flap_act", "flap_ratio", "sim/flightmodel/controls/flaprat", 10),
        ("rel_gear_act", "gear_handle_down", "sim/flightmodel2/gear/deploy_ratio", 60),
    ],
)
def test_flaps_and_gear_stop_where_their_drive_fails(bench, aircraft, failure, handle, shown, frames):
    """The tiltrotor's ailerons droop as flaps do, in a quarter of a second."""
    emulator = bench(aircraft=aircraft)
    emulator.write({"sim/cockpit2/controls/gear_handle_down": 0.0})
    emulator.step(600)
    emulator.write({"sim/cockpit2/controls/" + handle: 1.0})
    emulator.step(frames)
    emulator.write({FAILURES + failure: 6.0})
    (caught,) = emulator.read(shown)
    assert 0.01 < caught < 0.99
    emulator.step(120)
    assert emulator.read(shown, "sim/cockpit2/controls/" + handle) == [pytest.approx(caught, abs=1e-3), 1.0]
    emulator.write({FAILURES + failure: 0.0})
    emulator.step(600)
    assert emulator.read(shown) == [pytest.approx(1.0, abs=1e-3)]


def test_a_trim_that_runs_away_is_shown_and_stays_there_when_it_is_repaired(bench):
    emulator = bench()
    trim, failure = "sim/cockpit2/controls/elevator_trim", FAILURES + "rel_elv_trim_run"
    emulator.write({failure: 6.0, trim: 0.1})
    emulator.step(119)
    assert emulator.read(trim) == [pytest.approx(0.1 + 120 * 0.05 / 60.0)]  # 0.05 a second
    emulator.write({failure: 0.0})
    assert emulator.read(trim, ELEVATOR) == pytest.approx([0.2, -4.0], abs=1e-5)  # of 20 degrees


def test_a_trim_that_stands_takes_no_write(bench):
    emulator = bench()
    trim, failure = "sim/cockpit2/controls/aileron_trim", FAILURES + "rel_trim_ail"
    emulator.write({failure: 6.0, trim: 0.1})
    emulator.step()
    emulator.write({trim: 0.5})
    assert emulator.read(trim) == [pytest.approx(0.1)]
    emulator.write({failure: 0.0, trim: 0.5})
    assert emulator.read(trim) == [0.5]


def test_rese_repairs_everything(bench):
    emulator = bench()
    emulator.write({FAILURES + "rel_engfai0": 6.0, FAILURES + "rel_pitot": 6.0})
    emulator.step(2)
    emulator.client().send(protocol.RecoverAll())
    emulator.step(2)
    assert emulator.read(FAILURES + "rel_engfai0", FAILURES + "rel_pitot") == [0.0, 0.0]
    assert emulator.read("sim/flightmodel/engine/ENGN_running") == [1.0]


def test_surface_lock_exists_only_in_x_plane_12_and_keeps_the_present_position(bench):
    name = FAILURES + "rel_fcon_ailn_1_lft_lock"
    eleven = bench(version="11")
    client = eleven.client()
    client.subscribe([name])
    eleven.step()
    assert client.values() == {}
    twelve = bench(version="12")
    twelve.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.5})
    twelve.step(30)
    twelve.write({name: 6.0, YOKE_ROLL: -0.5})
    twelve.step(30)
    assert twelve.read(LEFT_AILERON, RIGHT_AILERON) == pytest.approx([10.0, 10.0])


def test_roll_authority_to_the_left_is_lost(bench):
    emulator = bench(version="11")
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: -0.5, FAILURES + "rel_fc_ail_L": 6.0})
    emulator.step(30)
    assert emulator.read(LEFT_AILERON) == [0.0]


def test_blocked_pitot_keeps_the_airspeed_of_its_moment(bench):
    emulator = bench()
    name = POSITION + "indicated_airspeed"
    emulator.step(5)
    emulator.write(
        {FAILURES + "rel_pitot": 6.0, OVERRIDE + "throttles": 1.0, THRO_USE + "[0]": 0.0, THRO_USE + "[1]": 0.0}
    )
    (before,) = emulator.read(name)
    emulator.step(300)
    (after,) = emulator.read(name)
    true = emulator.sim.model.state.calibrated_airspeed_mps * 3600 / 1852
    assert after == pytest.approx(before, abs=0.5)
    assert true < before - 5.0


def test_the_second_airspeed_is_of_the_copilots_own_tube(bench):
    emulator = bench()
    names = [POSITION + "indicated_airspeed2", "sim/cockpit2/gauges/indicators/airspeed_kts_copilot"]
    emulator.write({FAILURES + "rel_pitot": 6.0, THROTTLE + "_all": 0.0})
    (pilots,) = emulator.read(POSITION + "indicated_airspeed")
    emulator.step(300)
    second, gauge = emulator.read(*names)
    assert second == gauge < pilots - 5.0
    assert emulator.read(POSITION + "indicated_airspeed") == [pytest.approx(pilots, abs=0.5)]


def test_generators_and_batteries_feed_the_bus(bench):
    emulator = bench()
    bus = "sim/cockpit2/electrical/bus_volts"
    emulator.step(2)
    assert emulator.read(bus) == [28.0]
    emulator.write({FAILURES + "rel_genera0": 6.0, FAILURES + "rel_genera1": 6.0})
    emulator.step(2)
    (volts,) = emulator.read(bus)
    assert 20.0 < volts < 25.0
    emulator.write({"sim/cockpit2/electrical/battery_on[0]": 0.0})
    emulator.step(2)
    assert emulator.read(bus) == [0.0]


# --- what only a live X-Plane can settle ---


@pytest.mark.parametrize(("mode", "angle"), [("act", -20.0), ("ignored", 0.0)])
def test_failures_of_single_surfaces_act_or_are_ignored(bench, mode, angle):
    emulator = bench(version="12", surface_failures=mode)
    emulator.write({FAILURES + "rel_fcon_ailn_1_lft_mxup": 6.0})
    emulator.step(120)
    left, right, failure = emulator.read(LEFT_AILERON, RIGHT_AILERON, FAILURES + "rel_fcon_ailn_1_lft_mxup")
    assert (left, right, failure) == (pytest.approx(angle), 0.0, 6.0)


@pytest.mark.parametrize(("mode", "moved"), [("move", 0.25), ("frozen", 0.0)])
def test_total_stick_under_the_surface_override(bench, mode, moved):
    emulator = bench(aircraft="fixed_wing", overridden_totals=mode)
    total = "sim/cockpit2/controls/total_roll_ratio"
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.25})
    (before,) = emulator.read(total)
    emulator.write({OVERRIDE + "control_surfaces": 1.0, YOKE_ROLL: 0.5})
    after, stick = emulator.read(total, YOKE_ROLL)
    assert (after - before, stick) == (pytest.approx(moved, abs=1e-6), 0.5)
    emulator.write({OVERRIDE + "control_surfaces": 0.0})
    assert emulator.read(total)[0] - before == pytest.approx(0.25, abs=1e-6)


def test_frozen_totals_are_the_stick_of_then_also_where_they_are_asked_for_later(bench):
    emulator = bench(overridden_totals="frozen")
    emulator.write({OVERRIDE + "joystick": 1.0, YOKE_ROLL: 0.25})
    emulator.step(60)
    emulator.write({OVERRIDE + "control_surfaces": 1.0})
    emulator.step()
    assert emulator.read("sim/cockpit2/controls/total_roll_ratio") == [0.25]
