"""Effect of more or fewer agents: makespan, energy and proven bounds by fleet size."""

import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import count

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.budget import Budget
from alloc.allocators.experiments.fleets import Fleet, answer
from alloc.allocators.registry import load
from alloc.allocators.request import checked_objective
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import signals_set
from alloc.allocators.solve import solve
from alloc.problems import Allocation, InputError, Instance, Objective
from alloc.problems.arguments import event, flag, function, listed, of_type, shown, whole
from alloc.problems.errors import nearest

WHATIF_FORMAT = "alloc-whatif/1"

FIELDS = (
    "method", "status", "stop_reason", "makespan", "lower_bound", "gap", "energy", "energy_lower_bound", "energy_gap",
    "unserved_tasks", "runtime_s", "assignment",
)  # fmt: skip
"""Fields of a result that each fleet includes."""


@dataclass(frozen=True, eq=False)
class WhatIf:
    """Plans of several fleets, starting with that of the instance.

    Attributes
    ----------
    instance : Instance
    like : tuple of str
        Agents that are copied, one of each per step.
    fleets : tuple of Fleet
        The current fleet, then without the removed agents, if any, then with more agents step by step.
    complete : bool
        Whether no run was interrupted.
    """

    instance: Instance
    like: tuple[str, ...]
    fleets: tuple[Fleet, ...]
    complete: bool

    @property
    def answer(self) -> str:
        """One sentence on the effect of the first change and of the last."""
        return answer(self.fleets, self.like)

    def to_dict(self) -> dict[str, object]:
        """Return the fields of the format `alloc-whatif/1`, ready for JSON.

        Returns
        -------
        dict
        """
        return {
            "format": WHATIF_FORMAT,
            "instance": self.instance.name,
            "objective": str(self.fleets[0].result.objective),
            "like": list(self.like),
            "complete": self.complete,
            "answer": self.answer,
            "fleets": [_fleet_fields(fleet) for fleet in self.fleets],
        }


def _fleet_fields(fleet: Fleet) -> dict[str, object]:
    fields = fleet.result.to_dict()
    own = {"agents": fleet.result.instance.n, "added": list(fleet.added), "removed": list(fleet.removed)}
    return own | {name: fields[name] for name in FIELDS}


def whatif(
    instance: Instance,
    like: str | Sequence[str] = (),
    *,
    up_to: int = 1,
    remove: Iterable[str] = (),
    method: str | Allocator = "auto",
    objective: Objective | str = Objective.MAKESPAN,
    time_limit_s: float | None = 10.0,
    iterations: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    on_fleet: Callable[[Fleet], None] | None = None,
    stop: threading.Event | None = None,
    handle_signals: bool = True,
    parameters: object = None,
    **settings: object,
) -> WhatIf:
    """Solve an instance with its own agents, with fewer, and with more.

    Each run starts from the plan of the next smaller fleet, so that adding an agent never increases the makespan. A
    proven bound on the makespan of a fleet also holds for smaller ones.

    Parameters
    ----------
    instance : Instance
    like : str or sequence of str
        The agent or agents of which each step adds a copy with a new id, such as ``d2+1``.
    up_to : int
        Number of steps, >= 1.
    remove : iterable of str
        Agents that are removed before any is added.
    method, objective, seed, threads
        As in `solve`.
    time_limit_s, iterations
        Budget of the run for each fleet.
    on_fleet : callable, optional
        Called with every fleet once it is solved.
    stop : threading.Event, optional
        When set, ends the run in progress and returns the fleets so far.
    handle_signals : bool
        Whether SIGINT and SIGTERM do the same.
    parameters, **settings
        Parameters of the method, as in `solve`.

    Returns
    -------
    WhatIf

    Raises
    ------
    InputError, RefusedError
        As `solve` does; or if an agent is unknown, or none is to be added or removed.
    """
    of_type(instance, Instance, "instance")
    models = _agents(instance, [like] if isinstance(like, str) else like, "like")
    gone = frozenset(_agents(instance, remove, "remove"))
    if not models and not gone:
        raise InputError("needs an agent to add copies of, or agents to remove", "like")
    if len(gone) == instance.n:
        raise InputError("leaves no agent; keep at least one", "remove")
    of_type(method, (str, Allocator), "method")
    Budget(time_limit_s, iterations)
    function(on_fleet, "on_fleet")
    stop = event(stop, "stop") or threading.Event()
    handle_signals = flag(handle_signals, "handle_signals")
    if isinstance(method, str) and method != "auto":
        method, parameters, settings = load(method, parameters, **settings), None, {}
    run: Callable[..., Result] = solve
    run = partial(
        run,
        method=method,
        objective=checked_objective(objective),
        time_limit_s=time_limit_s,
        iterations=iterations,
        seed=seed,
        threads=threads,
        stop=stop,
        handle_signals=False,
        parameters=parameters,
        **settings,
    )
    steps = _copies(instance, models, whole(up_to, "up_to", 1))
    with signals_set(stop) if handle_signals else nullcontext():
        fleets = _solved(run, instance, steps, gone, on_fleet or (lambda _: None), stop)
    return WhatIf(instance, models, _with_shared_bounds(fleets), not stop.is_set())


def _agents(instance: Instance, names: Iterable[str], place: str) -> tuple[str, ...]:
    """Return ids of agents without repetitions, after checking that the instance has them."""
    for name in (found := listed(names, place, "ids of agents")):
        if not isinstance(name, str) or name not in instance.agent_index:
            known = nearest(name, instance.agent_ids) if isinstance(name, str) else ""
            raise InputError(f"no agent {shown(name)} in instance {instance.name!r}{known}", place)
    return tuple(dict.fromkeys(found))


Copies = list[dict[str, str]]
"""For each step, the id of the copied agent by the id of its copy."""


def _copies(instance: Instance, models: Sequence[str], steps: int) -> Copies:
    taken = frozenset(instance.agent_ids)
    free = {own: _free_names(own, taken) for own in models}
    return [{next(free[own]): own for own in models} for _ in range(steps if models else 0)]


def _free_names(own: str, taken: frozenset[str]) -> Iterator[str]:
    return (name for k in count(1) if (name := f"{own}+{k}") not in taken)


def _solved(
    run: Callable[..., Result],
    instance: Instance,
    steps: Copies,
    gone: frozenset[str],
    on_fleet: Callable[[Fleet], None],
    stop: threading.Event,
) -> list[Fleet]:
    """Return the current fleet, that without `gone`, and those with more agents, each started from a smaller one."""
    new = [{"id": name, "like": own} for step in steps for name, own in step.items()]
    full = instance.with_agents(new)

    def solved(added: Sequence[str], removed: frozenset[str], smaller: Fleet | None) -> Fleet:
        others = {row["id"] for row in new}.difference(added) | removed
        problem = full.without_agents(others) if others else full
        missing = tuple(name for name in instance.agent_ids if name in removed)
        fleet = Fleet(
            tuple(added), missing, run(problem, start=None if smaller is None else _plan(smaller.result, problem))
        )
        on_fleet(fleet)
        return fleet

    fleets = [solved((), gone, None)]
    if gone:
        fleets.insert(0, solved((), frozenset(), fleets[0]))
    added: list[str] = []
    for step in steps:
        if stop.is_set():
            break
        added += step
        fleets.append(solved(added, gone, fleets[-1]))
    return fleets


def _plan(smaller: Result, fleet: Instance) -> Allocation | None:
    """Return the plan of a smaller fleet as one of a larger fleet, whose additional agents are idle."""
    if smaller.allocation is None:
        return None
    return Allocation.from_ids(fleet, smaller.allocation.to_ids(smaller.instance))


def _with_shared_bounds(fleets: Sequence[Fleet]) -> tuple[Fleet, ...]:
    """Raise the bound on the makespan of each fleet to the bounds of larger fleets."""
    found = list(fleets)
    for k in reversed(range(len(found) - 1)):
        if not found[k + 1].removed or found[k].removed:
            found[k] = _raised(found[k], found[k + 1])
    if len(found) > 1 and found[1].removed:
        found[1] = _raised(found[1], found[0])
    return tuple(found)


def _raised(fleet: Fleet, larger: Fleet) -> Fleet:
    own, other = fleet.result.lower_bound, larger.result.lower_bound
    if own is None or other is None or fleet.result.makespan is None or other <= own:
        return fleet
    return replace(fleet, result=replace(fleet.result, lower_bound=min(other, fleet.result.makespan)))
