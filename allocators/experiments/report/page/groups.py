"""Groups of comparable runs, which were made under the same conditions."""

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass

from alloc.allocators.experiments.report.page.source import Archive, Known
from alloc.allocators.experiments.store.key import Run
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.store.store import CONDITIONS
from alloc.allocators.experiments.stored import Endings
from alloc.problems.text import one_line, short_names

LONGEST = 48
"""Maximum number of characters of the name of a method or an instance on a page."""

Conditions = tuple[object, ...]


@dataclass(frozen=True)
class Place:
    """Position of a run on a page: numbers of its group, method and instance, and its seed."""

    group: int
    method: int
    instance: int
    seed: int


@dataclass(frozen=True)
class Group:
    """Runs under the same conditions.

    Attributes
    ----------
    run : Run
        The first run.
    methods, instances : list of int
        Their numbers, in order of their first run.
    endings : mapping
        Endings of runs, by name of the method and by instance; numbers of runs and seeds may differ.
    common : list of int
        Positions in `instances` of those on which every method was run.
    """

    run: Run
    methods: list[int]
    instances: list[int]
    endings: Endings
    common: list[int]

    @property
    def endings_in_common(self) -> Endings:
        """Endings of runs on the instances on which every method was run."""
        return {label: [runs[position] for position in self.common] for label, runs in self.endings.items()}


@dataclass(frozen=True)
class Layout:
    """All runs of a page with their positions.

    Attributes
    ----------
    labels : list of str
        Names of the methods.
    names : list of str
        Names of the instances, all different.
    known : list of Known
        The instances.
    hashes : list of str
        Hashes of the instances' content.
    places : dict
        Place of each run, by its key.
    groups : list of Group
        Groups, the one with most runs first.
    """

    labels: list[str]
    names: list[str]
    known: list[Known]
    hashes: list[str]
    places: dict[str, Place]
    groups: list[Group]


def laid_out(archive: Archive) -> Layout:
    """Return the position of each run."""
    runs = {key: record.run for key, record in archive.records.items()}
    conditions = {key: _conditions(run) for key, run in runs.items()}
    count: dict[Conditions, int] = defaultdict(int)
    for one in conditions.values():
        count[one] += 1
    numbers = {one: number for number, one in enumerate(sorted(count, key=lambda one: -count[one]))}
    hashes = list(dict.fromkeys(run.instance for run in runs.values()))
    known = [archive.instances.get(one, Known(one[:12], 0, 0)) for one in hashes]
    variants = _labels(runs.values())
    labels = list(dict.fromkeys(variants.values()))
    method_of, instance_of = {one: n for n, one in enumerate(labels)}, {one: n for n, one in enumerate(hashes)}
    places = {
        key: Place(numbers[conditions[key]], method_of[variants[_variant(run)]], instance_of[run.instance], run.seed)
        for key, run in runs.items()
    }
    members: dict[int, list[str]] = defaultdict(list)
    for key, place in places.items():
        members[place.group].append(key)
    groups = [_group(archive, labels, places, members[number]) for number in range(len(numbers))]
    return Layout(labels, _different([one.name for one in known]), known, hashes, places, groups)


def _conditions(run: Run) -> Conditions:
    """Return the conditions that comparable runs share; versions of plugins are part of the method instead."""
    own = {**asdict(run), "version": run.version.partition(" + ")[0]}
    return tuple(own[name] for name in CONDITIONS)


def _variant(run: Run) -> tuple[str, str, str]:
    return run.method, run.parameters, run.version.partition(" + ")[2]


def _labels(runs: Iterable[Run]) -> dict[tuple[str, str, str], str]:
    """Return the label of each method with its parameters, as on the command line, and the version of plugins."""
    variants = list(dict.fromkeys(map(_variant, runs)))
    plain = {variant: _written(*variant[:2]) for variant in variants}
    versions: dict[str, set[str]] = defaultdict(set)
    for variant, text in plain.items():
        versions[text].add(variant[2])
    whole = [text if len(versions[text]) == 1 else f"{text} ({one[2]})" for one, text in plain.items()]
    return dict(zip(variants, short_names(whole, LONGEST), strict=True))


def _written(method: str, parameters: str) -> str:
    given = json.loads(parameters)
    parts = [f"{name}={_value(value)}" for name, value in given.items()]
    return f"{method}[{','.join(parts)}]" if parts else method


def _value(value: object) -> str:
    if isinstance(value, str) and value.startswith("sha256:"):
        return value[:15]
    return ",".join(map(str, value)) if isinstance(value, list) else str(value)


def _different(names: Sequence[str]) -> list[str]:
    """Return names on one line, numbered if several instances have the same name."""
    seen: dict[str, int] = defaultdict(int)
    found = []
    for name in map(one_line, names):
        seen[name] += 1
        found.append(name if seen[name] == 1 else f"{name} #{seen[name]}")
    return found


def _group(archive: Archive, labels: Sequence[str], places: Mapping[str, Place], keys: Sequence[str]) -> Group:
    own = [places[key] for key in keys]
    methods = list(dict.fromkeys(place.method for place in own))
    instances = list(dict.fromkeys(place.instance for place in own))
    row_of = {one: n for n, one in enumerate(instances)}
    endings: dict[str, list[list[Ending | None]]] = {labels[method]: [[] for _ in instances] for method in methods}
    for key, place in sorted(zip(keys, own, strict=True), key=lambda one: one[1].seed):
        endings[labels[place.method]][row_of[place.instance]].append(archive.records[key].ending)
    common = [n for n in range(len(instances)) if all(runs[n] for runs in endings.values())]
    return Group(archive.records[keys[0]].run, methods, instances, endings, common)
