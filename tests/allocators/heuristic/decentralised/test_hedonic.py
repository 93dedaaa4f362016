"""The decentralised coalition-formation game."""

import re

import numpy as np
import pytest
from hypothesis import assume, given
from strategies import instances

from alloc.allocators import Budget, RefusedError, Search, load, solve
from alloc.allocators.heuristic.decentralised.communication import hearing
from alloc.allocators.heuristic.decentralised.hedonic import CHANCE, Game, Parameters
from alloc.problems import IDLE, Allocation, Instance, Objective, evaluate, paper


def stable_game(instance: Instance, radius: float | None = None, objective: Objective = Objective.MAKESPAN) -> Game:
    """Play one game to its end."""
    game = Game(Search(instance, objective, Budget(None)), hearing(instance, radius), Parameters())
    game.begin(Allocation.idle(instance))
    game.search.stop_reason = lambda: None  # type: ignore[method-assign]  # to the end, whatever is proven before
    assert game.run(CHANCE)
    return game


def lack(instance: Instance, task_of_agent: np.ndarray) -> float:
    """Return the potential: the sum over tasks of the squared missing part at the coverage that all could have."""
    needed = instance.workload > 0
    group = evaluate(instance, Allocation(task_of_agent)).group_ability[needed]
    aim = instance.ability.sum() / instance.workload.sum()
    return float((np.maximum(0, 1 - group / instance.workload[needed] / aim) ** 2).sum())


@given(instances(speeds=False))
def test_ends_nash_and_exchange_stable(instance: Instance) -> None:
    """At the end of a game no agent alone, and no two that hear each other, can make the tasks lack less."""
    assume((instance.workload > 0).any())
    graph = hearing(instance)
    assume(graph.parts == 1)
    task = stable_game(instance).allocation.task_of_agent
    reached, before = instance.reach.mask[instance.reach.origin], lack(instance, task)
    for i in range(instance.n):
        for j in np.flatnonzero(reached[i] & (instance.workload > 0)).tolist():
            moved = task.copy()
            moved[i] = j
            assert lack(instance, moved) >= before - 1e-8
        heard = range(instance.n) if graph.everybody else graph.neighbour[graph.first[i] : graph.first[i + 1]]
        for k in heard:
            changed = task.copy()
            changed[i], changed[k] = task[k], task[i]
            if all(changed[a] == IDLE or reached[a, changed[a]] for a in (i, k)):
                assert lack(instance, changed) >= before - 1e-8


@given(instances(speeds=False, most_agents=6))
def test_who_hears_each_other_agrees(instance: Instance) -> None:
    """All agents of a connected part know one and the same partition, its scores right, at the end of a game."""
    assume((instance.workload > 0).any())
    game = stable_game(instance, radius=1.0, objective=Objective.MAKESPAN_ENERGY)
    minds, part, needed = game.minds, game.graph.part, instance.workload > 0
    for number in range(game.graph.parts):
        members = np.flatnonzero(part == number)
        plans = minds.plans[minds.knows[members]]
        assert (plans == plans[0]).all()
        assert (plans[:, part != number] == IDLE).all()
        group = evaluate(instance, Allocation(plans[0].astype(np.intp))).group_ability
        assert minds.covers[minds.knows[members[0]]][needed] == pytest.approx(group[needed] / instance.workload[needed])


def test_one_game_is_good() -> None:
    """On the paper's first scenario a single game comes within 3 % of the optimum, also on what is heard nearby."""
    for seed in range(1000, 1004):
        instance = paper(1, seed)
        assert evaluate(instance, stable_game(instance).allocation).makespan <= 1.03
        if hearing(instance, 0.6).parts == 1:
            assert evaluate(instance, stable_game(instance, 0.6).allocation).makespan <= 1.03


def test_second_game_saves_energy() -> None:
    """Where energy counts, a game ends with less energy than without, at no larger makespan than its first part."""
    instance = paper(1, 1000)
    thrifty = solve(instance, "hedonic", objective="makespan-energy", iterations=300, time_limit_s=None)
    careless = solve(instance, "hedonic", iterations=300, time_limit_s=None)
    assert thrifty.makespan <= 1.03
    assert thrifty.energy < 0.6 * careless.energy


def test_messages_are_counted() -> None:
    """Two agents that hear each other: each round's news is one message from each that has any."""
    result = solve(Instance(ability=[2, 1], workload=[2, 1]), "hedonic")
    said = re.fullmatch(r"the first game took (\d+) rounds and (\d+) messages", result.notes[0])
    assert said is not None
    # both join the first task, the first wins; that is news to the second, which joins the other; that is news in turn
    assert int(said[1]) >= 3
    assert int(said[2]) >= 3
    apart = Instance(ability=[2, 1], workload=[2, 1], agent_position=[[0], [5]] @ np.eye(1, 2))
    deaf = solve(apart, load("hedonic", hearing=1), iterations=100, time_limit_s=None)
    assert "0 messages" in deaf.notes[0]
    assert "2 parts of the agents cannot hear each other" in deaf.notes[1]


def test_parts_share_all_tasks_out() -> None:
    """Two halves that never hear of each other both give every task its share, so that nothing is left undone."""
    instance = Instance(
        ability=np.ones(40),
        workload=[2, 1, 1],
        agent_position=np.repeat([[0.0, 0.0], [9.0, 9.0]], 20, axis=0),
        task_position=[[4, 5], [5, 4], [5, 5]],
    )
    result = solve(instance, load("hedonic", hearing=1.0), iterations=500, time_limit_s=None)
    assert result.makespan == pytest.approx(result.lower_bound)


def test_too_many_agents_are_refused() -> None:
    """A plan in every agent's head takes n squared memory: too much for ten thousand."""
    with pytest.raises(RefusedError, match="plan of all"):
        solve(Instance(ability=np.ones(10_000), workload=[1, 1]), "hedonic")


def test_start_where_there_is_nothing_to_do() -> None:
    """Agents that start on a task without workload are free to go."""
    instance = Instance(ability=[2, 1, 1], workload=[0, 2, 1])
    result = solve(instance, "hedonic", start=Allocation([0, 0, 1]), iterations=50, time_limit_s=None)
    assert result.makespan == pytest.approx(1.0)
