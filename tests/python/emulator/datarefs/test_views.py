"""Views: which camera X-Plane draws, and what its datarefs report of it; worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.flight.flight_model import InitialState

VIEW = "sim/graphics/view/"
POSITION = "sim/flightmodel/position/"
#: Level flight to the north-east near the border between two origins, where the axes are half a degree apart.
PLACE = InitialState(latitude_deg=47.9, longitude_deg=8.45, heading_deg=30.0)


@pytest.fixture(name="emulator", params=["11.55", "12.10"])
def fixture_emulator(request):
    with EmulatorFixture(version=request.param, initial=PLACE) as emulator:
        yield emulator


def read(emulator, *leaves, folder=VIEW):
    return emulator.read(*(folder + leaf for leaf in leaves))


def write(emulator, leaf, value):
    emulator.write({VIEW + leaf: value})


def matrix(emulator, name):
    """A matrix of X-Plane's, which sends it column by column."""
    return np.array(read(emulator, *(f"{name}[{i}]" for i in range(16)))).reshape(4, 4).T


def camera_axes(emulator):
    """Right, up, back of the camera in OpenGL axes: the rows of world_matrix."""
    return matrix(emulator, "world_matrix")[:3, :3]


def look(emulator, view):
    client = emulator.client()
    client.send(protocol.CommandRequest("sim/view/" + view))
    emulator.step()


def psi(emulator):
    return math.radians(read(emulator, "psi", folder=POSITION)[0])


def relative(emulator):
    """Heading and pitch of `view_*` against the aircraft [deg]."""
    paths = (VIEW + "view_heading", VIEW + "view_pitch", POSITION + "psi", POSITION + "theta")
    heading, pitch, of_aircraft, theta = emulator.read(*paths)
    return (heading - of_aircraft + 180.0) % 360.0 - 180.0, pitch - theta


def arm(emulator):
    """From the aircraft to the camera, OpenGL axes [m]."""
    paths = [VIEW + f"view_{axis}" for axis in "xyz"] + [POSITION + f"local_{axis}" for axis in "xyz"]
    values = np.array(emulator.read(*paths))
    return values[:3] - values[3:]


def test_starts_with_the_panel_where_the_head_does_nothing(emulator):
    assert read(emulator, "view_type", "view_is_external") == [1000.0, 0.0]
    write(emulator, "pilots_head_psi", 90.0)
    write(emulator, "pilots_head_the", -30.0)
    assert relative(emulator) == pytest.approx((0.0, 0.0), abs=1e-4)
    look(emulator, "3d_cockpit_cmnd_look")  # straight ahead again
    assert relative(emulator) == pytest.approx((0.0, 0.0), abs=1e-4)
    write(emulator, "pilots_head_psi", 90.0)
    assert relative(emulator)[0] == pytest.approx(90.0, abs=0.01)  # the level is tilted against the scenery


def test_camera_stands_at_the_pilots_eye(emulator):
    look(emulator, "forward_with_nothing")
    to_camera = arm(emulator)
    eye = emulator.read(*(f"sim/aircraft/view/acf_pe{axis}" for axis in "XYZ"))
    # float32 steps by 8 mm at 45 km
    assert np.linalg.norm(to_camera) == pytest.approx(np.linalg.norm(eye), abs=0.02)
    ahead = to_camera @ (math.sin(psi(emulator)), 0.0, -math.cos(psi(emulator)))
    assert ahead == pytest.approx(-eye[2], abs=0.1)  # theta is small


def test_glances_and_views_from_outside_have_their_own_cameras(emulator):
    look(emulator, "back")
    assert read(emulator, "view_type") == [1010.0]
    assert abs(relative(emulator)[0]) == pytest.approx(180.0, abs=1e-4)
    look(emulator, "straight_down")
    assert read(emulator, "view_type") == [1025.0]
    back = camera_axes(emulator)[2]
    assert back[1] == pytest.approx(1.0, abs=0.01)  # it looks to the ground
    look(emulator, "chase")
    assert read(emulator, "view_is_external", "view_roll") == pytest.approx([1.0, 0.0], abs=1e-6)
    assert np.linalg.norm(arm(emulator)) == pytest.approx(math.hypot(30.0, 6.0), abs=0.02)


def test_visual_offset_turns_what_is_drawn_but_not_what_is_reported(emulator):
    look(emulator, "forward_with_nothing")
    write(emulator, "field_of_view_vertical_deg", -90.0)
    assert relative(emulator) == pytest.approx((0.0, 0.0), abs=1e-4)
    assert camera_axes(emulator)[2][1] == pytest.approx(1.0, abs=0.01)
    write(emulator, "field_of_view_vertical_deg", 0.0)
    write(emulator, "field_of_view_horizontal_deg", 90.0)
    heading = psi(emulator)
    right_of_it = np.array((math.cos(heading), 0.0, math.sin(heading)))
    assert -camera_axes(emulator)[2] @ right_of_it == pytest.approx(1.0, abs=1e-3)


def test_angles_are_against_the_scenerys_axes(emulator):
    origin, true_one = read(emulator, "psi", "true_psi", folder=POSITION)
    assert abs(origin - true_one) > 0.1
    assert relative(emulator)[0] == pytest.approx(0.0, abs=1e-4)


def test_projection_matrix_follows_the_field_of_view(emulator):
    write(emulator, "field_of_view_deg", 90.0)
    shown = matrix(emulator, "projection_matrix_3d")
    assert (shown[0, 0], shown[1, 1]) == pytest.approx((1.0, 1024 / 768), abs=1e-6)
    write(emulator, "vertical_field_of_view_deg", 60.0)
    emulator.write({"sim/graphics/settings/non_proportional_vertical_FOV": 1.0})
    write(emulator, "field_of_view_horizontal_ratio", 0.25)
    shown = matrix(emulator, "projection_matrix_3d")
    assert (shown[0, 0], shown[1, 1], shown[0, 2]) == pytest.approx((1.0, math.sqrt(3.0), 0.5), abs=1e-6)
