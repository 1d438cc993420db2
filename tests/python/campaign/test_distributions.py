from __future__ import annotations

import math

import numpy as np
import pytest

from xplane_bridge.campaign import distributions
from xplane_bridge.campaign.distributions import CampaignError, Design, parse_parameter, sobol_points


@pytest.mark.parametrize(
    ("item", "share", "value"),
    [
        ({"uniform": [-20, 15]}, 0.2, -13.0),
        ({"log_uniform": [0.1, 10]}, 0.25, 0.1 * math.sqrt(10.0)),
        ({"normal": [8, 4]}, 0.5, 8.0),
        ({"normal": [8, 4]}, 0.8413447460685429, 12.0),  # one deviation
        ({"normal": [8, 4], "clip": [0, 10]}, 0.9, 10.0),
        ({"triangular": [0, 1, 4]}, 0.25, 1.0),  # a quarter lies below the peak
        ({"triangular": [0, 1, 4]}, 0.25 + 0.75 * 0.75, 2.5),  # (4 - x)^2 / 12 = 0.1875
        ({"choice": ["a", "b", "c"]}, 0.34, "b"),
        ({"choice": [1, 2]}, 1.0, 2.0),
    ],
)
def test_values_by_hand(item: dict, share: float, value: object) -> None:
    assert parse_parameter("p", item).at(share) == pytest.approx(value)


@pytest.mark.parametrize(
    ("item", "values"),
    [
        ({"choice": [1, 2, 5, 9], "clip": [2, 7]}, [2, 2, 5, 7]),
        ({"choice": [1, 2, 5, 9], "clip": [1.5, 7]}, [1.5, 2, 5, 7]),
        ({"choice": [1.0, 2, 5, 9], "clip": [2, 7]}, [2.0, 2.0, 5.0, 7.0]),
        ({"uniform": [0, 4], "clip": [1, 2]}, [1.0, 1.5, 2.0, 2.0]),
    ],
)
def test_whole_numbers_stay_whole_where_they_are_clipped(item: dict, values: list) -> None:
    parameter = parse_parameter("p", item)
    assert repr([parameter.at(share) for share in (0.125, 0.375, 0.625, 0.875)]) == repr(values)


@pytest.mark.parametrize(
    ("name", "item", "text"),
    [
        ("a b", {"uniform": [0, 1]}, "parameters.a b: expected a name of letters"),
        ("p", {}, "parameters.p: {}; expected one of uniform"),
        ("p", {"uniform": [1, 0]}, "expected [low, high]"),
        ("p", {"log_uniform": [0, 1]}, "both above 0"),
        ("p", {"normal": [0, -1]}, "expected [mean, deviation]"),
        ("p", {"triangular": [0, 5, 4]}, "expected [low, most likely, high]"),
        ("p", {"choice": [1, "a"]}, "a list of numbers, or of texts"),
        ("p", {"uniform": [0, 1], "clip": [2, 1]}, "parameters.p.clip: [2, 1]; expected [low, high]"),
        ("p", {"uniform": [0, 1], "units": "m"}, "parameters.p.units: unknown key"),
    ],
)
def test_a_wrong_parameter_is_named(name: str, item: dict, text: str) -> None:
    with pytest.raises(CampaignError) as raised:
        parse_parameter(name, item)
    assert text in str(raised.value)


PARAMETERS = [parse_parameter(name, {"uniform": [0, 1]}) for name in "abc"]


def test_a_random_point_is_the_same_whatever_else_is_drawn() -> None:
    alone = Design(PARAMETERS, "random", 10, seed=7).values(3)
    after_others = Design(PARAMETERS, "random", 1000, seed=7)
    assert [after_others.values(i) for i in (9, 3)][1] == alone
    assert Design(PARAMETERS, "random", 10, seed=8).values(3) != alone
    assert len({Design(PARAMETERS, "random", 10, 7).turbulence_seed(i) for i in range(100)}) == 100


def test_a_hypercube_has_one_point_in_each_part_of_each_parameter() -> None:
    points = np.array([Design(PARAMETERS, "latin_hypercube", 50, 1).shares(i) for i in range(50)])
    for column in points.T:
        assert sorted((column * 50).astype(int)) == list(range(50))
    assert not np.array_equal(np.argsort(points[:, 0]), np.argsort(points[:, 1]))


def test_sobol_points_as_published() -> None:
    # The first points of the first three dimensions as Joe and Kuo print them.
    expected = [
        [0, 0, 0], [0.5, 0.5, 0.5], [0.75, 0.25, 0.25], [0.25, 0.75, 0.75], [0.375, 0.375, 0.625],
        [0.875, 0.875, 0.125], [0.625, 0.125, 0.875], [0.125, 0.625, 0.375],
    ]  # fmt: skip
    assert sobol_points(8, 3).tolist() == expected


def test_a_shifted_sobol_sequence_is_even_in_every_dimension() -> None:
    many = [parse_parameter(f"p{i}", {"uniform": [0, 1]}) for i in range(16)]
    points = np.array([Design(many, "sobol", 64, 3).shares(i) for i in range(64)])
    assert points.min() >= 0.0
    assert points.max() < 1.0
    for column in points.T:
        assert set(np.bincount((column * 8).astype(int), minlength=8)) <= {7, 8, 9}


@pytest.mark.parametrize("sampling", ["latin_hypercube", "sobol"])
def test_chunks_of_flights_share_the_points_of_all(sampling: str) -> None:
    points = {"latin_hypercube": distributions._hypercube, "sobol": distributions._sobol}[sampling]
    points.cache_clear()
    parameters = [parse_parameter(name, {"uniform": [0, 1]}) for name in ("a", "b")]
    for flight in (0, 10, 20):
        Design(parameters, sampling, 30, 1).values(flight)
    assert points.cache_info().misses == 1
    other_seed = Design(parameters, sampling, 30, 2).values(0)
    assert other_seed != Design(parameters, sampling, 30, 1).values(0)
