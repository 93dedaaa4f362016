"""The decentralised coalition-formation game."""

import re

import numpy as np
import pytest
from hypothesis import assume, given
from strategies import instances

from alloc.allocators import Budget, RefusedError, Search, load, solve
from alloc.allocators.heuristic.decentralised.coalition_game import CoalitionGame, HedonicParameters
from alloc.allocators.heuristic.decentralised.communication import communication_graph
from alloc.allocators.heuristic.decentralised.hedonic import Hedonic
from alloc.problems import IDLE, Allocation, InputError, Instance, Objective, evaluate, paper


def stable_game(
    instance: Instance, radius: float | None = None, objective: Objective = Objective.MAKESPAN
) -> CoalitionGame:
    """Play one game to its end."""
    game = CoalitionGame(
        Search(instance, objective, Budget(None)), communication_graph(instance, radius), HedonicParameters()
    )
    game.begin(Allocation.idle(instance))
    game.search.stop_reason = lambda: None  # type: ignore[method-assign]  # to the end, whatever is proven before
    assert game.run()
    return game


def shortfall(instance: Instance, task_of_agent: np.ndarray) -> float:
    """Return the potential: the sum over tasks of the squared relative shortfall at the mean coverage."""
    needed = instance.workload > 0
    group = evaluate(instance, Allocation(task_of_agent)).group_ability[needed]
    target = instance.ability.sum() / instance.workload.sum()
    return float((np.maximum(0, 1 - group / instance.workload[needed] / target) ** 2).sum())


@given(instances(speeds=False))
def test_final_partition_is_nash_and_exchange_stable(instance: Instance) -> None:
    """At the end of a game, no move of an agent and no swap of two neighbours reduces the shortfall."""
    assume((instance.workload > 0).any())
    graph = communication_graph(instance)
    assume(graph.n_components == 1)
    task = stable_game(instance).allocation.task_of_agent
    reached, before = instance.reach.mask[instance.reach.origin], shortfall(instance, task)
    for i in range(instance.n):
        for j in np.flatnonzero(reached[i] & (instance.workload > 0)).tolist():
            moved = task.copy()
            moved[i] = j
            assert shortfall(instance, moved) >= before - 1e-8
        neighbours = range(instance.n) if graph.is_complete else graph.neighbour[graph.begin[i] : graph.begin[i + 1]]
        for k in neighbours:
            changed = task.copy()
            changed[i], changed[k] = task[k], task[i]
            if all(changed[a] == IDLE or reached[a, changed[a]] for a in (i, k)):
                assert shortfall(instance, changed) >= before - 1e-8


@given(instances(speeds=False, most_agents=6))
def test_agents_of_a_component_agree_on_the_partition(instance: Instance) -> None:
    """At the end of a game, all agents of a component believe in the same partition, with the right coverages."""
    assume((instance.workload > 0).any())
    game = stable_game(instance, radius=1.0, objective=Objective.MAKESPAN_ENERGY)
    beliefs, component, needed = game.beliefs, game.graph.component, instance.workload > 0
    for number in range(game.graph.n_components):
        members = np.flatnonzero(component == number)
        plans = beliefs.plans[beliefs.version[members]]
        assert (plans == plans[0]).all()
        assert (plans[:, component != number] == IDLE).all()
        group = evaluate(instance, Allocation(plans[0].astype(np.intp))).group_ability
        assert beliefs.coverages[beliefs.version[members[0]]][needed] == pytest.approx(
            group[needed] / instance.workload[needed]
        )


def test_one_game_comes_close_to_the_optimum() -> None:
    """On the first scenario a single game is within 3 % of the optimum, also with local communication."""
    for seed in range(1000, 1004):
        instance = paper(1, seed)
        assert evaluate(instance, stable_game(instance).allocation).makespan <= 1.03
        if communication_graph(instance, 0.6).n_components == 1:
            assert evaluate(instance, stable_game(instance, 0.6).allocation).makespan <= 1.03


def test_second_game_saves_energy() -> None:
    """If energy counts, a game ends with less energy, at no larger makespan than its first part."""
    instance = paper(1, 1000)
    saving = solve(instance, "hedonic", objective="makespan-energy", iterations=300, time_limit_s=None)
    plain = solve(instance, "hedonic", iterations=300, time_limit_s=None)
    assert saving.makespan <= 1.03
    assert saving.energy < 0.6 * plain.energy


def test_messages_are_counted() -> None:
    """In each round, each of two neighbours with news sends one message."""
    result = solve(Instance(ability=[2, 1], workload=[2, 1]), "hedonic")
    said = re.fullmatch(r"the first game took (\d+) rounds and (\d+) messages", result.notes[0])
    assert said is not None
    # both join the first task, the first wins; that is news to the second, which joins the other; that is news in turn
    assert int(said[1]) >= 3
    assert int(said[2]) >= 3
    apart = Instance(ability=[2, 1], workload=[2, 1], agent_position=[[0], [5]] @ np.eye(1, 2))
    isolated = solve(apart, load("hedonic", communication_radius=1), iterations=100, time_limit_s=None)
    assert "0 messages" in isolated.notes[0]
    assert "the communication graph has 2 components" in isolated.notes[1]


def test_components_share_all_tasks() -> None:
    """Each of two components gives every task its share of the component's ability, so that all are served."""
    instance = Instance(
        ability=np.ones(40),
        workload=[2, 1, 1],
        agent_position=np.repeat([[0.0, 0.0], [9.0, 9.0]], 20, axis=0),
        task_position=[[4, 5], [5, 4], [5, 5]],
    )
    result = solve(instance, load("hedonic", communication_radius=1.0), iterations=500, time_limit_s=None)
    assert result.makespan == pytest.approx(result.lower_bound)


def test_too_many_agents_are_refused() -> None:
    """A plan of all agents for each agent takes n squared memory: too much for ten thousand agents."""
    with pytest.raises(RefusedError, match="plan of all"):
        solve(Instance(ability=np.ones(10_000), workload=[1, 1]), "hedonic")


def test_agents_starting_on_tasks_without_work_are_reassigned() -> None:
    """Agents that start on a task without workload are assigned to others."""
    instance = Instance(ability=[2, 1, 1], workload=[0, 2, 1])
    result = solve(instance, "hedonic", start=Allocation([0, 0, 1]), iterations=50, time_limit_s=None)
    assert result.makespan == pytest.approx(1.0)


def test_parameters_are_set_by_keyword() -> None:
    """Parameters are set by keyword, including an unlimited radius; wrong ones are named."""
    assert Hedonic(communication_radius=np.inf, partners=3).parameters == HedonicParameters(np.inf, partners=3)
    for name, value in (("communication_radius", -1), ("partners", 1.5), ("hearing", 1)):
        with pytest.raises(InputError) as caught:
            Hedonic(**{name: value})
        assert caught.value.place == name
