"""The emulator's datarefs and commands: those that the bridge uses, and none that X-Plane's version does not have."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol, xplane_names
from xplane_bridge.emulator.datarefs.commands import all_commands
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.xplane_names import VERSIONS

ROOT = Path(__file__).resolve().parents[4]
FIELDS = ROOT / "docs/fields.md"


@pytest.fixture(name="emulator", scope="module", params=VERSIONS)
def fixture_emulator(request):
    with EmulatorFixture(version=request.param, request_limit=1000) as emulator:
        yield emulator


@pytest.fixture(name="store", scope="module", params=VERSIONS)
def fixture_store(request):
    with EmulatorFixture(version=request.param) as emulator:
        yield request.param, emulator.sim.store


def expand(text):
    """`a{b,c}[*]` -> `ab[0]`, `ac[0]`."""
    parts = [part.strip("{}").split(",") for part in re.split(r"(\{[^}]*\})", text.replace("[*]", "[0]"))]
    return ["".join(choice) for choice in itertools.product(*parts)]


def listed(version):
    """Every dataref of docs/fields.md for an X-Plane version that it is used with."""
    paths = []
    for line in FIELDS.read_text(encoding="utf-8").splitlines():
        columns = line.split("|")
        if len(columns) < 6:
            continue
        for word, number, name in re.findall(r"(?:(from|before) ([\d.]+): )?`(sim/[^`]+)`", columns[3]):
            border = xplane_names.first_version(number) if number else 0
            later = xplane_names.first_version(version) >= border
            if later is (word != "before"):
                paths += expand(name)
    return paths


def test_every_dataref_of_the_field_table_is_served(store):
    version, datarefs = store
    paths = listed(version)
    assert len(paths) > 200
    missing = [path for path in paths if datarefs.slot(path) is None]
    assert missing == []


def answered(emulator, paths):
    """Those of the paths that a client gets values of."""
    client = emulator.client()
    for first in range(0, len(paths), 500):
        client.subscribe(paths[first : first + 500], first_index=first)
        emulator.emulator.server.receive()
    emulator.step()
    return {paths[index] for index in client.values()}


def test_no_name_is_answered_that_the_list_of_the_version_does_not_have(emulator):
    version = emulator.emulator.options.version
    union = sorted(set().union(*map(xplane_names.datarefs, VERSIONS)))
    assert len(union) > 5000
    known = answered(emulator, union)
    assert len(known) > 1000  # a client does get values
    assert known - set(xplane_names.datarefs(version)) == set()
    # every name that the emulator has in a version that lists it
    assert known == {name for name in emulator.sim.store.names() if name in union}


def test_own_values_of_the_emulator_and_made_up_names_are_not_answered(emulator):
    names = ["_emulator/frame_rate", "_emulator/gear_force_n[0]", "sim/operation/failures/rel_inver0", "sim/none"]
    assert answered(emulator, names) == set()


def test_arrays_have_their_size_and_no_element_more(emulator):
    facts = xplane_names.datarefs(emulator.emulator.options.version)
    names = emulator.sim.store.names()
    last = [f"{name}[{facts[name].size - 1}]" for name in names]
    assert answered(emulator, last) == set(last)
    beyond = [f"{name}[{facts[name].size}]" for name in names]
    assert answered(emulator, [path for path in beyond if path not in facts]) == set()


def test_what_is_read_only_in_the_list_keeps_its_value(emulator):
    store = emulator.sim.store
    facts = xplane_names.datarefs(emulator.emulator.options.version)
    read_only = [name for name in store.names() if not facts[name].writable]
    assert len(read_only) > 100
    before = store.values.copy()
    for name in read_only:
        assert not store.write(name, store.get(name) + 1.0), name
    assert (store.values == before).all()


def test_a_command_of_another_version_does_nothing():
    for version, paused in (("11.40", 0.0), ("12.00", 0.0), ("12.08", 0.0), ("12.10", 1.0)):
        with EmulatorFixture(version=version) as emulator:
            emulator.client().send(protocol.CommandRequest("sim/operation/pause_on"))
            emulator.step()
            assert emulator.read("sim/time/paused") == [paused], version
            assert emulator.emulator.server.ignored["command"] == (0 if paused else 1)


def test_every_command_is_one_of_x_planes():
    with EmulatorFixture() as emulator:
        names = all_commands(emulator.sim)
    assert [name for name in names if not xplane_names.versions_with(name)] == []


@pytest.mark.parametrize(
    ("name", "versions"),
    [
        ("sim/flightmodel/position/equivalent_airspeed", {"12.00", "12.08", "12.10"}),
        ("sim/flightmodel2/position/pressure_altitude", {"12.08", "12.10"}),
        ("sim/flightmodel2/engines/nacelle_vertical_angle_deg[0]", {"11.40", "11.55"}),
        ("sim/aircraft/view/acf_ui_name[0]", {"12.00", "12.08", "12.10"}),
        ("sim/cockpit2/controls/flap_handle_request_ratio", {"12.00", "12.08", "12.10"}),
        ("sim/cockpit2/controls/flap_ratio", set(VERSIONS)),
        ("sim/weather/wind_now_x_msc", set(VERSIONS)),
        ("sim/weather/aircraft/wind_now_x_msc", {"12.08", "12.10"}),
        ("sim/flightmodel/engine/ENGN_thro_use[7]", set(VERSIONS)),
        ("sim/flightmodel/engine/ENGN_thro_use[8]", {"12.08", "12.10"}),
        ("sim/flightmodel/engine/ENGN_thro_override[1]", set()),
        ("sim/operation/failures/rel_fc_ail_L", {"11.40", "11.55", "12.08", "12.10"}),
        ("sim/operation/failures/rel_ail_L_jam", {"12.00", "12.08", "12.10"}),
        ("sim/operation/failures/rel_fcon_ailn_1_lft_lock", {"12.00", "12.08", "12.10"}),
        ("sim/operation/failures/rel_fcon_flap_1_lft_cntr", set()),
        ("sim/operation/failures/rel_prpsep0", {"12.08", "12.10"}),
        ("sim/operation/failures/rel_engfai7", set(VERSIONS)),
        ("sim/operation/override/override_control_surfaces", set(VERSIONS)),
        ("sim/network/dataout/data_to_internet[138]", set(VERSIONS)),
        ("sim/flightmodel2/wing/rudder1_deg[10]", set(VERSIONS)),
    ],
)
def test_what_exists_depends_on_the_version(emulator, name, versions):
    version = emulator.emulator.options.version
    assert (answered(emulator, [name]) == {name}) is (version in versions)


def test_written_datarefs_of_the_bridge_are_writable(store):
    version, datarefs = store
    controls = "sim/cockpit2/controls/"
    names = [
        controls + leaf
        for leaf in (
            "elevator_trim",
            "aileron_trim",
            "rudder_trim",
            "speedbrake_ratio",
            "gear_handle_down",
            "thrust_vector_ratio",
            "left_brake_ratio",
            "right_brake_ratio",
            "parking_brake_ratio",
        )
    ]
    names.append(controls + ("flap_handle_request_ratio" if version.startswith("12") else "flap_ratio"))
    names += [f"sim/joystick/yoke_{axis}_ratio" for axis in ("pitch", "roll", "heading")]
    names += ["sim/cockpit2/engine/actuators/throttle_ratio", "sim/cockpit2/engine/actuators/throttle_jet_rev_ratio"]
    names += ["sim/flightmodel/engine/ENGN_thro_use", "sim/flightmodel/engine/ENGN_thro_override"]
    names += [
        f"sim/operation/override/override_{leaf}"
        for leaf in ("joystick", "throttles", "control_surfaces", "toe_brakes")
    ]
    for wing, leaf in itertools.product(
        ("1l", "1r", "2l", "2r", "3l", "3r", "4l", "4r"), ("ail1", "ail2", "fla1", "spo1")
    ):
        names.append(f"sim/flightmodel/controls/wing{wing}_{leaf}def")
    names += ["sim/graphics/view/field_of_view_deg", "sim/graphics/view/pilots_head_the", "sim/time/zulu_time_sec"]
    assert [name for name in names if datarefs.slot(name) is None or not datarefs.dataref(name).writable] == []


def test_two_names_of_one_thing_share_their_values(store):
    _, datarefs = store
    datarefs.write("sim/cockpit2/controls/aileron_trim", 0.5)
    assert datarefs.get("sim/flightmodel/controls/ail_trim") == 0.5
    assert datarefs.get("sim/flightmodel2/controls/aileron_trim") == 0.5


SCALAR, LAYER = "sim/weather/wind_speed_kt", "sim/weather/wind_speed_kt[0]"
ACTUATORS = "sim/cockpit2/engine/actuators/"
ARRAY, TEXT = "sim/network/dataout/data_to_internet", "sim/aircraft/view/acf_ICAO"


def test_store_paths():
    store = DatarefStore("11.40")
    for name in (SCALAR, LAYER, ARRAY, TEXT):
        store.add(name)
    assert store.slot(ARRAY) == store.slot(ARRAY + "[0]")
    assert store.slot(ARRAY + "[2]") == store.slot(ARRAY) + 2
    assert [end for end in ("[200]", "[-1]", "[]", "[0", "[1][1]", "/") if store.slot(ARRAY + end) is not None] == []
    assert [path for path in (SCALAR + "[1]", "sim/", "") if store.slot(path) is not None] == []
    assert store.write(ARRAY + "[1]", -2.7)
    assert store.array(ARRAY)[:3].tolist() == [0.0, -2.0, 0.0]
    assert not store.write(TEXT + "[0]", 65.0)  # byte[] writes are ignored
    assert not store.write(SCALAR, 1.0)  # read-only
    with pytest.raises(ValueError, match="defined twice"):
        store.add(SCALAR)
    with pytest.raises(ValueError, match=r"a/made_up_name is in no list of X-Plane's"):
        store.add("a/made_up_name")


def test_the_first_element_of_a_scalar_is_the_scalar():
    store = DatarefStore("11.40")
    store.add("sim/time/sim_speed")
    assert store.slot("sim/time/sim_speed[0]") == store.slot("sim/time/sim_speed")
    assert store.slot("sim/time/sim_speed[1]") is None


def test_a_name_with_brackets_is_a_name_of_its_own_or_an_element():
    whole, cut = DatarefStore("11.40"), DatarefStore("11.40", brackets=False)
    for store in (whole, cut):
        store.add(SCALAR)
        store.add(LAYER)
    assert whole.slot(LAYER) != whole.slot(SCALAR)
    assert whole.write(LAYER, 20.0)
    assert cut.slot(LAYER) == cut.slot(SCALAR)
    assert not cut.write(LAYER, 20.0)  # the scalar is read-only


def test_a_name_of_another_version_works_inside_but_not_for_clients():
    store = DatarefStore("11.40")
    store.add("sim/aircraft/view/acf_ui_name")
    store.set_text("sim/aircraft/view/acf_ui_name", "Glider")
    assert store.get("sim/aircraft/view/acf_ui_name") == ord("G")
    assert store.slot("sim/aircraft/view/acf_ui_name[0]") is None
    assert store.names() == []


def test_an_alias_with_fewer_elements_shows_the_first_ones():
    store = DatarefStore("11.40")
    store.add(ACTUATORS + "throttle_ratio")
    store.add_alias(ACTUATORS + "throttle_ratio_all", ACTUATORS + "throttle_ratio")
    assert store.slot(ACTUATORS + "throttle_ratio_all") == store.slot(ACTUATORS + "throttle_ratio[0]")
    with pytest.raises(ValueError, match=r"mixture_ratio has 1 elements, in X-Plane 8"):
        store.add_alias(ACTUATORS + "mixture_ratio", ACTUATORS + "throttle_ratio_all")
