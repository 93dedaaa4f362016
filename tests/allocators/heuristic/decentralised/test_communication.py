"""The communication graph."""

import numpy as np
import pytest
from hypothesis import given
from strategies import instances

from alloc.allocators.heuristic.decentralised.communication import communication_graph
from alloc.problems import Instance


def neighbours(graph, agent: int) -> list[int]:
    return sorted(graph.neighbour[graph.begin[agent] : graph.begin[agent + 1]].tolist())


def test_a_line_of_agents() -> None:
    """Neighbours are within both ranges; an isolated agent is a component of its own."""
    instance = Instance(
        ability=np.ones(4),
        workload=[1],
        agent_position=[[0, 0], [1, 0], [2.5, 0], [9, 0]],
        communication_range=[1, 2, 1.5, 3],
    )
    graph = communication_graph(instance)
    assert [neighbours(graph, agent) for agent in range(4)] == [[1], [0, 2], [1], []]
    assert graph.n_components == 2
    assert graph.degree.tolist() == [1, 2, 1, 0]
    assert communication_graph(instance, 9).is_complete
    assert communication_graph(instance, 0.5).n_components == 4


def test_graph_is_complete_without_ranges_or_locations() -> None:
    """Without ranges or locations the graph is complete; an agent without a location connects all others."""
    far = [[0, 0], [9, 9], [99, 99]]
    assert communication_graph(Instance(ability=[1, 1, 1], workload=[1], agent_position=far)).is_complete
    assert communication_graph(Instance(ability=[1, 1, 1], workload=[1], communication_range=[1, 1, 1])).is_complete
    lost = Instance(
        ability=[1, 1, 1], workload=[1], agent_position=[[0, 0], [np.nan] * 2, [99, 99]], communication_range=[1, 1, 1]
    )
    graph = communication_graph(lost)
    assert neighbours(graph, 1) == [0, 2]
    assert graph.n_components == 1


@given(instances(most_agents=6))
def test_graph_matches_the_definition(instance: Instance) -> None:
    """The graph equals the one from comparing all pairs, and no edge joins two components."""
    graph = communication_graph(instance)
    position, reach = instance.start_position, instance.communication_range
    for i in range(instance.n):
        expected = []
        for k in range(instance.n):
            distance = np.linalg.norm(position[i] - position[k])
            if i != k and (np.isnan(distance) or distance <= min(reach[i], reach[k]) + 1e-9):
                expected.append(k)
        if graph.is_complete:
            assert len(expected) == instance.n - 1
        else:
            assert neighbours(graph, i) == expected
        assert (graph.component[expected] == graph.component[i]).all()
    assert graph.degree.sum() == pytest.approx(2 * (graph.degree.sum() // 2))
