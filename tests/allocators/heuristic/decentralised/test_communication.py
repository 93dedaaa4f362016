"""Who hears whom."""

import numpy as np
import pytest
from hypothesis import given
from strategies import instances

from alloc.allocators.heuristic.decentralised.communication import hearing
from alloc.problems import Instance


def neighbours(graph, agent: int) -> list[int]:
    return sorted(graph.neighbour[graph.first[agent] : graph.first[agent + 1]].tolist())


def test_a_line_of_agents() -> None:
    """Each hears those within its own range and theirs; who is near nobody is a part of its own."""
    instance = Instance(
        ability=np.ones(4),
        workload=[1],
        agent_position=[[0, 0], [1, 0], [2.5, 0], [9, 0]],
        communication_range=[1, 2, 1.5, 3],
    )
    graph = hearing(instance)
    assert [neighbours(graph, agent) for agent in range(4)] == [[1], [0, 2], [1], []]
    assert graph.parts == 2
    assert graph.degree.tolist() == [1, 2, 1, 0]
    assert hearing(instance, 9).everybody
    assert hearing(instance, 0.5).parts == 4


def test_unlimited_or_unknown_is_everybody() -> None:
    """Without ranges, or without places, everybody hears everybody; who alone is lost hears all and joins the parts."""
    far = [[0, 0], [9, 9], [99, 99]]
    assert hearing(Instance(ability=[1, 1, 1], workload=[1], agent_position=far)).everybody
    assert hearing(Instance(ability=[1, 1, 1], workload=[1], communication_range=[1, 1, 1])).everybody
    lost = Instance(
        ability=[1, 1, 1], workload=[1], agent_position=[[0, 0], [np.nan] * 2, [99, 99]], communication_range=[1, 1, 1]
    )
    graph = hearing(lost)
    assert neighbours(graph, 1) == [0, 2]
    assert graph.parts == 1


@given(instances(most_agents=6))
def test_graph_by_definition(instance: Instance) -> None:
    """The graph is that of all pairs looked at one by one, and parts never cut an edge."""
    graph = hearing(instance)
    place, span = instance.start_position, instance.communication_range
    for i in range(instance.n):
        heard = []
        for k in range(instance.n):
            apart = np.linalg.norm(place[i] - place[k])
            if i != k and (np.isnan(apart) or apart <= min(span[i], span[k]) + 1e-9):
                heard.append(k)
        if graph.everybody:
            assert len(heard) == instance.n - 1
        else:
            assert neighbours(graph, i) == heard
        assert (graph.part[heard] == graph.part[i]).all()
    assert graph.degree.sum() == pytest.approx(2 * (graph.degree.sum() // 2))
