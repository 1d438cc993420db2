"""The lists of datarefs and commands, and what is read out of them. Expected facts are looked up in the lists."""

import pytest

from xplane_bridge import xplane_names
from xplane_bridge.xplane_names import VERSIONS, Dataref, commands, datarefs, version_of, versions_with


@pytest.mark.parametrize(
    ("internal", "version"),
    [(105100, "11.40"), (114000, "11.40"), (115499, "11.40"), (115500, "11.55"), (115502, "11.55"), (119999, "11.55"),
     (120000, "12.00"), (120799, "12.00"), (120812, "12.08"), (121000, "12.10"), (122015, "12.10")],
)  # fmt: skip
def test_a_list_holds_until_the_next_one(internal, version):
    assert version_of(internal) == version


@pytest.mark.parametrize(
    ("version", "name", "expected"),
    [
        ("11.40", "sim/flightmodel/engine/ENGN_power", Dataref("float", (8,), True, "")),
        ("11.55", "sim/flightmodel/engine/ENGN_power", Dataref("float", (8,), True, "")),
        ("12.00", "sim/flightmodel/engine/ENGN_power", Dataref("float", (8,), True, "")),
        ("12.08", "sim/flightmodel/engine/ENGN_power", Dataref("float", (16,), True, "")),
        ("12.10", "sim/flightmodel/engine/ENGN_power", Dataref("float", (16,), True, "")),
        ("12.08", "sim/flightmodel2/position/pressure_altitude", Dataref("double", (), False, "feet")),
        ("12.08", "sim/weather/region/wind_speed_msc", Dataref("float", (13,), True, "kts")),
        ("12.10", "sim/weather/region/wind_speed_msc", Dataref("float", (13,), True, "m/s")),
        ("12.10", "sim/aircraft/view/acf_relative_path", Dataref("byte", (1024,), False, "string")),
        # The brackets are part of this name.
        ("11.40", "sim/weather/wind_speed_kt[0]", Dataref("float", (), True, "kts")),
    ],
)
def test_what_the_lists_say_of_a_dataref(version, name, expected):
    assert datarefs(version)[name] == expected


@pytest.mark.parametrize(
    ("name", "versions"),
    [
        ("sim/operation/pause_toggle", VERSIONS),
        ("sim/operation/pause_on", ("12.10",)),
        ("sim/operation/pause_off", ("12.10",)),
        ("sim/aircraft/view/acf_ui_name", ("12.00", "12.08", "12.10")),
        ("sim/flightmodel2/engines/nacelle_vertical_angle_deg", ("11.40", "11.55")),
        # left out of one list
        ("sim/operation/failures/rel_fc_ail_L", ("11.40", "11.55", "12.08", "12.10")),
        ("sim/operation/failures/rel_inver0", ()),
    ],
)
def test_which_versions_have_a_name(name, versions):
    assert tuple(versions_with(name)) == versions


def test_commands_of_12_08_are_those_that_the_lists_before_and_after_share():
    assert commands("12.08") == commands("12.00") & commands("12.10")


def test_sizes_and_arrays():
    matrix = Dataref("float", (56, 10, 4))
    assert (matrix.is_array, matrix.size) == (True, 2240)
    assert (Dataref("float").is_array, Dataref("float").size) == (False, 1)
    assert (Dataref("byte", (0,)).is_array, Dataref("byte", (0,)).size) == (True, 0)


@pytest.mark.parametrize("version", VERSIONS)
def test_every_cell_of_every_list_can_be_read(version):
    assert len(datarefs(version)) > 4000
    assert len(commands(version)) > 2000
    names = [name for name, _ in xplane_names._rows("datarefs.txt")] + [
        name for name, _ in xplane_names._rows("commands.txt")
    ]
    assert all(name.startswith("sim/") and " " not in name for name in names)
    for file in ("datarefs.txt", "commands.txt"):
        names = [name for name, _ in xplane_names._rows(file)]
        assert len(set(names)) == len(names)


def test_an_unknown_version_is_refused():
    with pytest.raises(ValueError, match=r"version 12: expected one of 11\.40, 11\.55"):
        datarefs("12")
