from __future__ import annotations

from pathlib import Path

import pytest

from xplane_bridge.bags.units import NO_UNIT, Unit, parse_units

DEFINITION = """# A comment with [m] in it
uint32 FLAG = 1   # [m] a constant has no column
std_msgs/Header header   # stamp: host time
float32 speed            # [m/s] over ground
float64 heading_deg      # [deg] 0..360, clockwise
float64 roll_deg         # [deg] -180..180, right +
float32[8] oil           # [deg C, or deg F by aircraft] temperature
float32 ratio            # [-1..1] right +
float32 stop             # [0, 1] pressed
geometry_msgs/Vector3 rates   # [rad/s^2] body
bool on
duration age             # how old it is
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""


def test_units_and_wraps_follow_the_comments() -> None:
    units = parse_units(DEFINITION, "pkg/State")
    assert units["speed"] == Unit("m/s", 0.0, 0.0)
    assert units["heading_deg"] == Unit("deg", 360.0, 0.0)
    assert units["roll_deg"] == Unit("deg", 360.0, -180.0)
    assert units["rates.y"].symbol == "rad/s^2"
    assert units["oil"].symbol == "deg C"
    for plain in ("ratio", "stop", "on", "header.stamp", "header.seq"):
        assert units[plain] == NO_UNIT
    assert units["age"].symbol == "s"
    assert "FLAG" not in units
    assert len(units) == 14


def test_units_of_elements_and_of_kinds_are_no_unit_of_all() -> None:
    text = """float32[3] clock        # [h, min, s] of the cockpit
float32[2] heat_on      # [0, 1] left, right
float32[8] oil          # [deg C, or deg F by aircraft] temperature
float32[] values        # [deg] angle of a stuck surface; [0..1] what remains; [deg/s] rate of a slow one; NaN else
float32[] since         # [s] raw simulator time; sim/time/total_running_time_sec
"""
    units = parse_units(text, "pkg/State")
    assert (units["clock"].each, units["clock"].suffix) == (("h", "min", "s"), "")
    assert units["heat_on"] == units["values"] == NO_UNIT
    assert (units["oil"].symbol, units["oil"].each) == ("deg C", ())
    assert units["since"].symbol == "s"


@pytest.mark.parametrize(
    ("symbol", "suffix"),
    [("m/s", "mps"), ("rad/s^2", "radps2"), ("N m", "Nm"), ("%", "percent"), ("deg C", "degC"), ("", "")],
)
def test_suffixes_are_fit_for_column_names(symbol: str, suffix: str) -> None:
    assert Unit(symbol, 0.0, 0.0).suffix == suffix


def test_every_number_of_flight_state_has_a_unit_or_is_dimensionless_on_purpose() -> None:
    text = (Path(__file__).parents[3] / "msg" / "FlightState.msg").read_text()
    units = parse_units(text, "xplane_bridge/FlightState")
    assert units["altitude_msl"].symbol == "m"
    assert units["heading_true_deg"].wrap == 360.0
    assert units["wind_ned"].symbol == "m/s"
    unitless = {name for name, unit in units.items() if not unit.symbol}
    assert unitless == {
        "header", "valid", "epoch", "frame_count", "paused", "replay", "position_epoch", "position_source",
        "orientation", "mach", "control_roll", "control_pitch", "control_yaw", "control_throttle", "on_ground",
    }  # fmt: skip
