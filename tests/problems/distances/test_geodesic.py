"""Distances on the earth agree with pyproj, also across the date line and the poles."""

import numpy as np
import pytest
from pyproj import Geod

from alloc.problems import Instance, Units
from alloc.problems.distances.geodesic import METRES, embedded, geodesic_distances

PAIRS = 10_000


def places(rng: np.random.Generator) -> np.ndarray:
    """Draw places all over the earth, a third of them around the poles and a third around the date line."""
    lon, lat = rng.uniform(-180, 180, PAIRS), np.degrees(np.arcsin(rng.uniform(-1, 1, PAIRS)))
    third = PAIRS // 3
    lat[:third] = np.sign(lat[:third]) * rng.uniform(89, 90, third)
    lon[third : 2 * third] = np.where(rng.random(third) < 0.5, 1, -1) * rng.uniform(179.5, 180, third)
    return np.column_stack([lon, lat, np.zeros(PAIRS)])


@pytest.mark.parametrize("unit", METRES)
def test_distances_match_pyproj(unit: str) -> None:
    """Within 0.1 % on 10,000 pairs, and a straight line is never longer."""
    rng = np.random.default_rng(0)
    one, other = places(rng), places(rng)
    expected = Geod(ellps="WGS84").inv(one[:, 0], one[:, 1], other[:, 0], other[:, 1])[2] / METRES[unit]
    found = geodesic_distances(one, other, unit)
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    straight = np.linalg.norm(embedded(one, unit) - embedded(other, unit), axis=1)
    assert (straight <= found * (1 + 1e-9)).all()


def test_altitude_counts_and_unknown_places_are_at_distance_zero() -> None:
    """Altitude differences count by Pythagoras, and unknown places are at distance 0, as in (1)."""
    one = np.array([[0, 0, 3000.0], [0, 0, 0], [np.nan] * 3])
    other = np.array([[0, 0, -1000.0], [0, 0.0, 250], [1.0, 1, 0]])
    assert geodesic_distances(one, other, "m").tolist() == [4000, 250, 0]


@pytest.mark.parametrize("shape", [(0,), (1,), (1, 1), (2, 1)])
def test_distances_have_the_shape_of_the_input(shape: tuple[int, ...]) -> None:
    """Any number of pairs works, also one, about which some versions of numpy and pyproj warn."""
    away = geodesic_distances(np.zeros((*shape, 3)), np.array([0.0, 0, 7]), "m")
    assert away.tolist() == np.full(shape, 7.0).tolist()


def test_distances_use_the_unit_of_the_instance() -> None:
    """Distances of an instance are in its unit, and reach is by them."""
    instance = Instance(
        ability=[1, 1],
        workload=[1],
        agent_position=[[179.9, 10], [-179.9, 10]],
        task_position=[[-179.9, 10]],
        metric="geographic",
        units=Units(distance="mi"),
        communication_range=[13, 13.7],
    )
    away = instance.reach.distance[instance.reach.origin][0, 0]
    assert away == pytest.approx(13.63, abs=0.01)
    assert instance.reach.mask[instance.reach.origin].tolist() == [[False], [True]]
