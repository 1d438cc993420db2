"""Coefficients of a made-up aircraft, worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from xplane_bridge.identification.coefficients import Geometry, derivatives
from xplane_bridge.identification.model import LATERAL, LONGITUDINAL, AxisModel

AIRCRAFT = Geometry(wing_area=2.0, chord=0.5, span=4.0, mass=10.0, ixx=2.0, iyy=3.0, izz=4.0, ixz=0.5)
SPEED, PRESSURE = 20.0, 250.0  # q S = 500 N, q S c = 250 N m, q S b = 2000 N m


def model_of(axis, a: np.ndarray, b: np.ndarray, a_interval: np.ndarray, b_interval: np.ndarray) -> AxisModel:
    found = AxisModel(axis, axis.inputs, a, b, np.zeros((4, 4)), np.zeros((4, b.shape[1])), [])
    found.a_interval, found.b_interval = a_interval, b_interval
    return found


def test_longitudinal_coefficients() -> None:
    a, b = np.zeros((4, 4)), np.zeros((4, 1))
    a[1, 1], a[2, 1], a[2, 2], b[2, 0] = -2.0, -5.0, -1.5, -8.0
    found = derivatives(model_of(LONGITUDINAL, a, b, np.abs(a) / 10, np.abs(b) / 10), AIRCRAFT, SPEED, PRESSURE)
    assert found["CL_alpha"].value == pytest.approx(2.0 * 10 * 20 / 500)
    assert found["Cm_alpha"].value == pytest.approx(-5.0 * 3 / 250)
    assert found["Cm_q"].value == pytest.approx(-1.5 * 3 / 250 * 2 * 20 / 0.5)
    assert found["Cm_de"].value == pytest.approx(-8.0 * 3 / 250)
    assert found["Cm_de"].interval == pytest.approx(0.8 * 3 / 250)
    assert (found["Cm_de"].unit, found["Cm_q"].unit) == ("1/rad", "")
    heavier = derivatives(model_of(LONGITUDINAL, a, b, a, b), AIRCRAFT, SPEED, PRESSURE, mass=20.0)
    assert heavier["CL_alpha"].value == pytest.approx(2 * found["CL_alpha"].value)


def test_the_product_of_inertia_couples_roll_and_yaw() -> None:
    # p' = 3, r' = 2 per rad of aileron: L = 2 * 3 - 0.5 * 2 = 5 N m, N = 4 * 2 - 0.5 * 3 = 6.5 N m.
    a, b = np.zeros((4, 4)), np.zeros((4, 2))
    b[1, 0], b[2, 0], a[0, 0], a[1, 1] = 3.0, 2.0, -0.25, -4.0
    width = np.zeros((4, 2))
    width[1, 0], width[2, 0] = 0.3, 0.2
    found = derivatives(model_of(LATERAL, a, b, np.zeros((4, 4)), width), AIRCRAFT, SPEED, PRESSURE)
    assert found["Cl_da"].value == pytest.approx(5.0 / 2000)
    assert found["Cn_da"].value == pytest.approx(6.5 / 2000)
    assert found["Cl_da"].interval == pytest.approx(math.hypot(2 * 0.3, 0.5 * 0.2) / 2000)
    assert found["CY_beta"].value == pytest.approx(-0.25 * 10 * 20 / 500)
    assert found["Cl_p"].value == pytest.approx(-4.0 * 2 / 2000 * 2 * 20 / 4.0)
    assert found["Cn_p"].value == pytest.approx(4.0 * 0.5 / 2000 * 2 * 20 / 4.0)
    assert "CY_p" not in found
