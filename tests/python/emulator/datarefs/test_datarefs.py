"""The emulator's datarefs: all that the bridge reads or writes exist, in the version they belong to."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import pytest

from support.emulator_fixture import EmulatorFixture
from xplane_bridge.emulator.datarefs.store import DatarefStore, Kind

ROOT = Path(__file__).resolve().parents[4]
FIELDS = ROOT / "docs" / "fields.md"


@pytest.fixture(name="store", scope="module", params=[11, 12])
def fixture_store(request):
    with EmulatorFixture(version=request.param) as bench:
        yield request.param, bench.sim.store


def expand(text):
    """`a{b,c}[*]` -> `ab[0]`, `ac[0]`."""
    parts = [part.strip("{}").split(",") for part in re.split(r"(\{[^}]*\})", text.replace("[*]", "[0]"))]
    return ["".join(choice) for choice in itertools.product(*parts)]


def listed(version):
    """Every dataref of docs/fields.md for an X-Plane version."""
    paths = []
    for line in FIELDS.read_text(encoding="utf-8").splitlines():
        columns = line.split("|")
        if len(columns) < 6 or "`sim/" not in columns[3]:
            continue
        eleven, _, twelve = columns[3].partition("12:")
        chosen = twelve if version == 12 and "`sim/" in twelve else eleven
        for name in re.findall(r"`(sim/[^`]+)`", chosen):
            paths += expand(name)
    return paths


def test_every_dataref_of_the_field_table_is_served(store):
    version, datarefs = store
    paths = listed(version)
    assert len(paths) > 200
    missing = [path for path in paths if datarefs.slot(path) is None]
    assert missing == []


@pytest.mark.parametrize(
    ("name", "versions"),
    [
        ("sim/flightmodel/position/equivalent_airspeed", {12}),
        ("sim/cockpit2/controls/flap_handle_request_ratio", {12}),
        ("sim/cockpit2/controls/flap_ratio", {11, 12}),
        ("sim/weather/wind_now_x_msc", {11}),
        ("sim/weather/aircraft/wind_now_x_msc", {12}),
        ("sim/flightmodel/engine/ENGN_thro_use[7]", {11, 12}),
        ("sim/flightmodel/engine/ENGN_thro_use[8]", {12}),
        ("sim/operation/failures/rel_fc_ail_L", {11}),
        ("sim/operation/failures/rel_ail_L_jam", {12}),
        ("sim/operation/failures/rel_fcon_ailn_1_lft_lock", {12}),
        ("sim/operation/failures/rel_fcon_rudd_1_ctr_mxup", {12}),
        ("sim/operation/failures/rel_engfai7", {11, 12}),
        ("sim/operation/override/override_control_surfaces", {11, 12}),
        ("sim/network/dataout/data_to_internet[138]", {11, 12}),
        ("sim/flightmodel2/wing/rudder1_deg[10]", {11, 12}),
        ("_emulator/frame_rate", set()),
    ],
)
def test_what_exists_depends_on_the_version(store, name, versions):
    version, datarefs = store
    assert (datarefs.slot(name) is not None) is (version in versions)


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
    names.append(controls + ("flap_handle_request_ratio" if version == 12 else "flap_ratio"))
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


def test_store_paths():
    store = DatarefStore()
    store.add("a/scalar", Kind.FLOAT, writable=True)
    store.add("a/array", Kind.INT, size=3, writable=True)
    store.add("a/named[0]", Kind.FLOAT, writable=True)
    store.add("a/text", Kind.BYTE, size=4, writable=True)
    assert store.slot("a/array") == store.slot("a/array[0]")
    assert store.slot("a/array[2]") == store.slot("a/array") + 2
    for unknown in ("a/array[3]", "a/array[-1]", "a/array[]", "a/scalar[0]", "a/", "", "a/array[0", "a/array[1][1]"):
        assert store.slot(unknown) is None, unknown
    assert store.write("a/named[0]", 4.0)
    assert store.write("a/array[1]", -2.7)
    assert store.array("a/array").tolist() == [0.0, -2.0, 0.0]
    assert not store.write("a/text[0]", 65.0)  # byte[] writes are ignored
    with pytest.raises(ValueError, match="defined twice"):
        store.add("a/scalar")
