"""Draw the pictures and write the pages of docs/data/gallery.md: ``python docs/make_gallery.py``."""

from collections.abc import Callable
from pathlib import Path

from alloc.allocators import (
    Result,
    animate_mission,
    pareto,
    plot,
    plot_convergence,
    plot_mission,
    simulate,
    solve,
    write_result,
)
from alloc.allocators.plotting import plot_front
from alloc.problems import (
    Course,
    Family,
    Instance,
    MissionParameters,
    Recorder,
    Units,
    paper,
    random_instance,
    random_mission,
    read_instance,
)

FOLDER = Path(__file__).parent / "data" / "gallery"
ALASKA = Path(__file__).parents[1] / "examples" / "earthquakes" / "alaska.json"

BASES = {
    "Bodø": (14.40, 67.28, 2),
    "Tromsø": (18.95, 69.65, 1),
    "Alta": (23.27, 69.97, 3),
    "Hammerfest": (23.68, 70.66, 3),
}
"""Longitude, latitude and number of drones of some towns in the north of Norway."""

SITES = {
    "Lofoten": (13.9, 68.3, 12),
    "Senja": (17.5, 69.3, 8),
    "Nordkapp": (25.78, 71.17, 20),
    "Vesterålen": (15.4, 68.9, 5),
    "Karasjok": (25.5, 69.47, 9),
}
"""Longitude, latitude and km2 to photograph."""


def north(**more: object) -> Instance:
    """Return nine drones at four towns, and five sites."""
    towns = [(f"{town}-{k + 1}", (lon, lat)) for town, (lon, lat, count) in BASES.items() for k in range(count)]
    fields: dict[str, object] = {
        "name": "north",
        "agent_ids": [name for name, _ in towns],
        "agent_position": [place for _, place in towns],
        "ability": [4, 6, 5, 3, 4, 6, 8, 5, 4],
        "speed": [80] * 9,
        "battery": [60] * 9,
        "returns": [True] * 9,
        "energy_per_distance": 0.1,
        "task_ids": list(SITES),
        "task_position": [(lon, lat) for lon, lat, _ in SITES.values()],
        "workload": [area for _, _, area in SITES.values()],
        "metric": "geographic",
        "units": Units(time="h", distance="km", energy="kWh", work="km2"),
    }
    return Instance(**{**fields, **more})  # type: ignore[arg-type]


def large() -> Instance:
    """Return 5,000 agents at a depot, and 300 tasks."""
    return random_instance(Family(agents=5_000, tasks=300, starts="depots"), 0)


def answer(instance: Instance, method: str, seed: int = 0, iterations: int = 30) -> Result:
    """Return a plan that is the same on every machine."""
    return solve(instance, method, objective="makespan-energy", seed=seed, iterations=iterations)


def runs() -> list[Result]:
    """Return three runs on Alaska, of a second each."""
    alaska = read_instance(ALASKA)
    wanted = (("local-search", 0), ("local-search", 1), ("ga", 0))
    return [solve(alaska, method, objective="makespan-energy", seed=seed, time_limit_s=1) for method, seed in wanted]


def mission() -> Course:
    """Return the course of a mission of six agents, with failures and local knowledge."""
    recorder = Recorder(with_knowledge=True)
    drawn = random_mission(MissionParameters(family="failures", agents=6, tasks=12), seed=3)
    return recorder.course(simulate(drawn, "gappo", deadline_ms=None, observe=recorder).result)


PICTURES: dict[str, Callable[[str], object]] = {
    "north": lambda path: plot(answer(north(), "milp"), path),
    "unserved": lambda path: plot(answer(north(battery=[15] * 9), "milp"), path),
    "paper": lambda path: plot(answer(paper(1, seed=7), "milp"), path),
    "alaska": lambda path: plot(answer(read_instance(ALASKA), "local-search", iterations=200_000), path),
    "large": lambda path: plot(answer(large(), "greedy"), path),
    "times": lambda path: plot(answer(Instance(name="times", ability=[4, 3, 2, 2], workload=[9, 7, 3]), "milp"), path),
    "front": lambda path: plot_front(pareto(north(), "milp", points=6, iterations=30), path),
    "runs": lambda path: plot_convergence(runs(), path),
    "mission": lambda path: plot_mission(mission(), path),
}


def main() -> None:
    """Write all pictures, a map of a plan and a page that plays a mission."""
    FOLDER.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        path = FOLDER / f"{name}.png"
        draw(str(path))
        reduce_colours(path)
    write_result(answer(north(), "milp"), FOLDER / "north.html")
    animate_mission(mission(), str(FOLDER / "mission.html"))


def reduce_colours(path: Path) -> None:
    """Reduce a picture to 256 colours, which takes a third of the size."""
    from PIL import Image

    with Image.open(path) as picture:
        reduced = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    reduced.save(path, optimize=True)


if __name__ == "__main__":
    main()
