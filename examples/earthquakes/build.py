"""Build `alaska.json`: survey drones at Alaskan airfields, and the sites of one week of earthquakes.

Run ``python examples/earthquakes/build.py``. Earthquakes and airfields are real, drones are fictitious; see README.md.
"""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from alloc.problems import Instance, Units
from alloc.problems.formats import write_instance

HERE = Path(__file__).parent
OUTPUT = HERE / "alaska.json"
CENTRE = (62.0, -152.0)
"""Latitude and longitude of the middle of the map, in degrees."""
WEST, EAST = -166.0, -129.0
"""Longitudes in degrees: the mainland, Kodiak and the Panhandle, without the Aleutian Islands."""
EARTH_RADIUS_KM = 6371.0088
SITE_RADIUS_KM = 80.0
KWH_PER_KM = 0.15

LIGHT, MEDIUM, HEAVY = (
    # km2 photographed per hour, radio range in km, endurance on a full battery in km
    ("light", 6.0, 600.0, 800.0),
    ("medium", 11.0, 800.0, 1000.0),
    ("heavy", 20.0, np.inf, 1200.0),
)
FLEETS = ((LIGHT, MEDIUM), (LIGHT, LIGHT), (MEDIUM, HEAVY), (LIGHT, MEDIUM), (MEDIUM, MEDIUM))
"""Pairs of drones, assigned to the airfields cyclically in the order of their codes."""


def main() -> None:
    """Write the instance to `OUTPUT`."""
    instance = build()
    write_instance(instance, OUTPUT)
    share = instance.reach.mask[instance.reach.origin].mean()
    print(f"{instance.n} drones, {instance.m} sites; a drone reaches {100 * share:.0f} % of the sites on average")


def build() -> Instance:
    """Return the instance: distances in km, times in hours, energy in kWh, workloads in km2."""
    airfields, quakes = read("airfields.csv"), read("quakes.csv")
    sites = list(group_sites(quakes))
    agents = list(station_drones(airfields))
    return Instance(
        name="alaska",
        agent_ids=[agent["id"] for agent in agents],
        ability=[agent["ability"] for agent in agents],
        agent_position=np.round([agent["position"] for agent in agents], 3),
        communication_range=[agent["range"] for agent in agents],
        battery=[agent["battery"] for agent in agents],
        task_ids=[site[0]["id"] for site in sites],
        workload=[round(area_to_survey(site), 1) for site in sites],
        task_position=np.round([[*project(site[0]), 0.0] for site in sites], 3),
        priority=[float(site[0]["magnitude"]) for site in sites],
        energy_per_distance=KWH_PER_KM,
        units=Units(time="h", distance="km", energy="kWh", work="km2"),
    )


def read(name: str) -> list[dict[str, str]]:
    """Read the rows within `WEST` to `EAST` of a CSV file that lies beside this script."""
    with open(HERE / name, encoding="utf-8", newline="") as file:
        return [row for row in csv.DictReader(file) if WEST <= float(row["longitude"]) <= EAST]


def project(row: dict[str, str]) -> NDArray[np.float64]:
    """Return km east and north of the centre: azimuthal equidistant, on a sphere.

    Distances from the centre are exact; others are off by 1 % at most.
    """
    lat, lon = np.radians([float(row["latitude"]), float(row["longitude"])])
    lat0, lon0 = np.radians(CENTRE)
    east = np.cos(lat) * np.sin(lon - lon0)
    north = np.cos(lat0) * np.sin(lat) - np.sin(lat0) * np.cos(lat) * np.cos(lon - lon0)
    sine = np.hypot(east, north)
    angle = np.arctan2(sine, np.sin(lat0) * np.sin(lat) + np.cos(lat0) * np.cos(lat) * np.cos(lon - lon0))
    scale = EARTH_RADIUS_KM * (angle / sine if sine > 0 else 1.0)
    return np.array([east, north]) * scale


def group_sites(quakes: list[dict[str, str]]) -> Iterator[list[dict[str, str]]]:
    """Group quakes around the strongest: each joins the first site whose main shock is within `SITE_RADIUS_KM`."""
    sites: list[list[dict[str, str]]] = []
    for quake in sorted(quakes, key=lambda row: (-float(row["magnitude"]), row["id"])):
        near = (site for site in sites if np.hypot(*(project(site[0]) - project(quake))) <= SITE_RADIUS_KM)
        site = next(near, None)
        if site is None:
            sites.append([quake])
        else:
            site.append(quake)
    yield from sites


def area_to_survey(site: list[dict[str, str]]) -> float:
    """Return the area to photograph in km2: the largest shaken area plus a twentieth of each other one. Our choice."""
    areas = [shaken_area(quake) for quake in site]
    return max(areas) + 0.05 * (sum(areas) - max(areas))


def shaken_area(quake: dict[str, str]) -> float:
    """Return an area in km2 that grows with magnitude and shrinks with depth. Our choice."""
    depth_km = max(0.0, float(quake["depth_km"]))
    return float(20 * 10 ** (0.4 * float(quake["magnitude"])) / (1 + depth_km / 50))


def station_drones(airfields: list[dict[str, str]]) -> Iterator[dict[str, Any]]:
    """Station two drones at each airfield, with batteries 60 to 100 % full and abilities that fall with elevation."""
    for count, row in enumerate(airfields):
        elevation_km = float(row["elevation_ft"]) * 0.3048e-3
        for number, (kind, ability, radio_km, endurance_km) in enumerate(FLEETS[count % len(FLEETS)], start=1):
            charge = 0.6 + 0.4 * ((2 * count + number) * 0.6180339887 % 1)
            yield {
                "id": f"{row['icao']}-{kind}-{number}",
                "ability": round(ability * (1 - 0.1 * elevation_km), 2),
                "position": [*project(row), elevation_km],
                "range": radio_km,
                "battery": round(KWH_PER_KM * endurance_km * charge, 1),
            }


if __name__ == "__main__":
    main()
