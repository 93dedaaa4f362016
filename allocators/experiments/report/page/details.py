"""Details of single instances on a page: a map with the best plan of each method, and traces of runs."""

import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from alloc.allocators.experiments.report.page.encode import compressed
from alloc.allocators.experiments.report.page.groups import Layout
from alloc.allocators.experiments.report.page.source import Archive, moment
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.plan import unpacked
from alloc.allocators.plan.places import Base, Places, bases, places
from alloc.problems import Allocation, InputError, Instance, evaluate
from alloc.problems.formats.npz import from_npz
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.text import one_line

Entry = dict[str, object]

MAX_AGENTS = 1000
"""Maximum number of agents on a map; if there are more, an evenly spaced subset is drawn."""

MAX_TASKS = 1000
"""Maximum number of tasks on a map; if there are more, those with the largest workloads are drawn."""

MAX_TRACES = 200
"""Maximum number of runs of an instance whose traces are drawn."""

CHUNK = 200_000
"""Characters that are compressed together; a browser unpacks a chunk when one of its instances is shown."""

SIZE = 10_000
"""Larger of width and height of a map in its integer units."""


def details(
    archive: Archive, layout: Layout, most_bytes: int, told: Callable[[int], None] = lambda count: None
) -> tuple[list[str], dict[int, int]]:
    """Return maps and traces of as many instances as fit into a size limit.

    Instances are taken in the order of their hashes, which is effectively random.

    Parameters
    ----------
    archive : Archive
    layout : Layout
    most_bytes : int
        Maximum total size, compressed.
    told : callable
        Called with the number of instances completed.

    Returns
    -------
    chunks : list of str
        Compressed mappings from instance numbers to details.
    chunk_of : dict
        The chunk of each instance.
    """
    runs: dict[int, list[str]] = defaultdict(list)
    for key, place in layout.places.items():
        runs[place.instance].append(key)
    chunks: list[str] = []
    chunk_of: dict[int, int] = {}
    waiting: dict[int, str] = {}
    used = 0
    order = sorted(range(len(layout.hashes)), key=lambda number: layout.hashes[number])
    contents = archive.contents([layout.hashes[number] for number in order])
    ahead = next(contents, None)
    for count, number in enumerate(order):
        content = None
        if ahead is not None and ahead[0] == layout.hashes[number]:
            content, ahead = ahead[1], next(contents, None)
        waiting[number] = json.dumps(_detail(archive, layout, number, runs[number], content), allow_nan=False)
        if sum(map(len, waiting.values())) >= CHUNK or count == len(order) - 1:
            chunks.append(compressed("{" + ",".join(f'"{one}":{text}' for one, text in waiting.items()) + "}"))
            chunk_of |= dict.fromkeys(waiting, len(chunks) - 1)
            used += len(chunks[-1])
            waiting = {}
            told(count + 1)
            if used >= most_bytes:
                break
    return chunks, chunk_of


def _detail(archive: Archive, layout: Layout, number: int, keys: Sequence[str], content: bytes | None) -> Entry:
    shown = sorted(keys, key=lambda key: (layout.places[key].group, layout.places[key].seed))[:MAX_TRACES]
    found: Entry = {
        "runs": len(keys),
        "groups": sorted({layout.places[key].group for key in keys}),
        "traces": [
            _trace(archive.records[key].ending, layout, key) for key in shown if archive.records[key].ending.trace
        ],
    }
    if content is None:
        return found
    try:
        instance = from_npz(content, layout.names[number])
    except InputError:  # left out of the page
        return found
    return found | {"map": _map(archive, layout, instance, keys)}


def _trace(ending: Ending, layout: Layout, key: str) -> Entry:
    """Return the trace of a run: indices of `EDGES_S` at which the makespan improved, and makespans."""
    place = layout.places[key]
    steps: list[float] = []
    best = math.inf
    for time_s, makespan, *_ in ending.trace:
        if makespan is not None and makespan < best:
            best = makespan
            steps += [moment(time_s), rounded(makespan)]
    return {"group": place.group, "method": place.method, "seed": place.seed, "steps": steps}


def rounded(value: float) -> float:
    """Return a value rounded to six significant digits."""
    return float(f"{value:.6g}")


def _map(archive: Archive, layout: Layout, instance: Instance, keys: Sequence[str]) -> Entry:
    """Return positions of tasks and agents in integer units, and the plans; without positions if none are known."""
    where = places(instance)
    begin = [base for base in bases(instance, where, MAX_AGENTS) if len(base.agents)]
    agents, tasks = _drawn_agents(instance, begin), np.sort(np.argsort(-instance.workload, kind="stable")[:MAX_TASKS])
    low, unit = _frame(where)
    base_of = {agent: number for number, base in enumerate(begin) for agent in base.agents.tolist()}
    return {
        "agents": instance.n,
        "tasks": instance.m,
        "axes": where.axes,
        "aspect": where.aspect,
        "origin": low.tolist(),
        "unit": unit,
        "units": {"time": instance.units.time, "energy": instance.units.energy},
        "task": {
            "id": [one_line(instance.task_ids[j]) for j in tasks],
            "work": [rounded(instance.workload[j]) for j in tasks],
            "place": _whole((where.tasks[tasks] - low) / unit),
        },
        "base": {
            "name": [one_line(base.name) for base in begin],
            "place": [place for base in begin for place in _whole((base.place[None] - low) / unit)],
        },
        "agent": {
            "id": [one_line(instance.agent_ids[i]) for i in agents],
            "base": [base_of.get(int(i), -1) for i in agents],
        },
        "plans": list(_plans(archive, layout, instance, keys, agents, tasks)),
    }


def _drawn_agents(instance: Instance, begin: Sequence[Base]) -> IntArray:
    """Return the agents to draw: all, or a subset with known places if there are many."""
    if instance.n <= MAX_AGENTS:
        return np.arange(instance.n)
    known = np.sort(np.concatenate([base.agents for base in begin])) if begin else np.arange(instance.n)
    return known[np.unique(np.linspace(0, len(known) - 1, MAX_AGENTS).astype(np.intp))]


def _frame(where: Places) -> tuple[FloatArray, float]:
    """Return the lower left corner of all places, and the length of one map unit on the axes."""
    known = where.known
    if not len(known):
        return np.zeros(2), 1.0
    low = known.min(axis=0)
    spread = known.max(axis=0) - low
    return low, float(spread.max()) / SIZE or 1.0


def _whole(place: FloatArray) -> list[list[int] | None]:
    return [None if np.isnan(x) else [round(x), round(y)] for x, y in place.tolist()]


def _plans(
    archive: Archive, layout: Layout, instance: Instance, keys: Sequence[str], agents: IntArray, tasks: IntArray
) -> Iterator[Entry]:
    """Yield the best stored plan of each method under the same conditions."""
    shown = np.full(instance.m + 1, -2)  # -2 for tasks that are not drawn
    shown[tasks], shown[-1] = np.arange(len(tasks)), -1
    for key, plan in archive.plans(_best_runs(archive, layout, keys)).items():
        place, ending = layout.places[key], archive.records[key].ending
        try:
            task_of_agent = unpacked(plan).task_of_agent
            score = evaluate(instance, Allocation(task_of_agent))
        except InputError:  # damaged plans are left out
            continue
        count = np.bincount(task_of_agent[task_of_agent >= 0], minlength=instance.m)
        yield {
            "group": place.group,
            "method": place.method,
            "seed": place.seed,
            "makespan": ending.makespan,
            "energy": ending.energy,
            "unserved": ending.unserved,
            "of": shown[task_of_agent[agents]].tolist(),
            "done": [rounded(time) if math.isfinite(time) else None for time in score.completion_time[tasks].tolist()],
            "count": count[tasks].tolist(),
            "ability": [rounded(ability) for ability in score.group_ability[tasks].tolist()],
        }


def _best_runs(archive: Archive, layout: Layout, keys: Sequence[str]) -> list[str]:
    """Return the run with the best result of each method under the same conditions."""
    best: dict[tuple[int, int], str] = {}
    for key in keys:
        ending, place = archive.records[key].ending, layout.places[key]
        if ending.outcome is Outcome.SOLVED:
            other = best.setdefault((place.group, place.method), key)
            if _rank(ending) < _rank(archive.records[other].ending):
                best[place.group, place.method] = key
    return list(best.values())


def _rank(ending: Ending) -> tuple[float, float, float]:
    makespan = ending.makespan if ending.makespan is not None else ending.served_makespan
    return ending.unserved or 0, math.inf if makespan is None else makespan, ending.energy or 0.0
