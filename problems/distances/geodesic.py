"""Distances along the surface of the earth (WGS 84), computed by pyproj."""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from alloc.problems.distances.metric import Floats
from alloc.problems.units import METRES as EXACT_METRES

if TYPE_CHECKING:
    from pyproj import Geod

METRES = {unit: float(EXACT_METRES[unit]) for unit in ("m", "km", "mi", "nmi")}
"""Metres in each unit of geographic distances."""

EQUATORIAL_RADIUS_M = 6_378_137.0
FLATTENING = 1 / 298.257223563


def geodesic_distances(place: Floats, goal: Floats, unit: str) -> Floats:
    """Return distances between arrays of places, with broadcasting; 0 where a coordinate is NaN.

    Geodesics by Karney (2013), doi:10.1007/s00190-012-0578-z, combined with altitude differences by Pythagoras.

    Parameters
    ----------
    place, goal : ndarray, shape (..., 3)
        Longitude and latitude in degrees, altitude in metres.
    unit : str
        One of `METRES`.
    """
    a, b = np.broadcast_arrays(place, goal)
    unknown = np.isnan(a[..., 0]) | np.isnan(b[..., 0])
    lon, lat, other_lon, other_lat = (
        np.where(unknown, 0.0, part) for part in (a[..., 0], a[..., 1], b[..., 0], b[..., 1])
    )
    if unknown.size == 1:  # pyproj converts arrays of one element to scalars, which some versions of numpy warn about
        _, _, surface = _ellipsoid().inv(lon.item(), lat.item(), other_lon.item(), other_lat.item())
    else:
        _, _, surface = _ellipsoid().inv(lon, lat, other_lon, other_lat)
    climb = np.where(unknown, 0.0, a[..., 2] - b[..., 2])
    distance: Floats = np.hypot(np.asarray(surface), climb) / METRES[unit]
    return distance


def embedded(place: Floats, unit: str) -> Floats:
    """Return Cartesian coordinates of the places at altitude 0, shape (k, 3).

    Straight lines between them are at most as long as geodesics, and about as long at short distances, also across
    the date line and the poles; spatial trees are built on them.
    """
    lon, lat = np.radians(place[:, 0]), np.radians(place[:, 1])
    squared_eccentricity = FLATTENING * (2 - FLATTENING)
    normal = EQUATORIAL_RADIUS_M / np.sqrt(1 - squared_eccentricity * np.sin(lat) ** 2)
    x, y = normal * np.cos(lat) * np.cos(lon), normal * np.cos(lat) * np.sin(lon)
    z = normal * (1 - squared_eccentricity) * np.sin(lat)
    return np.column_stack([x, y, z]) / METRES[unit]


@cache
def _ellipsoid() -> "Geod":
    from pyproj import Geod

    return Geod(ellps="WGS84")
