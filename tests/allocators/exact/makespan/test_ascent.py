import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import tiny_instance

from alloc.allocators import solve
from alloc.allocators.exact.makespan.ascent import ConfigurationAscent
from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound
from alloc.allocators.exact.model import Model
from alloc.problems import Instance, agent_classes, fewest_unserved, makespan_lower_bound

SERVED = [
    seed for seed in range(60) if tiny_instance(seed).workload.any() and fewest_unserved(tiny_instance(seed)) == 0
]


def ascent_on(instance: Instance, price: np.ndarray | None = None) -> tuple[ConfigurationAscent, float]:
    """Return the ascent from the bound by fractional agents, and that bound; from given prices if any."""
    model = Model.build(instance, agent_classes(instance, by_place=False), int((instance.workload > 0).sum()))
    low, found = relaxed_lower_bound(model, makespan_lower_bound(instance), 1e9, 10.0, lambda: False)
    assert found is not None
    return ConfigurationAscent(model, low, found if price is None else price[: len(model.tasks)]), low


@pytest.mark.parametrize("seed", SERVED)
def test_bound_is_valid_for_any_prices(seed):
    """From any initial prices, after any number of rounds, no makespan from the optimum on is excluded."""
    instance, rng = tiny_instance(seed), np.random.default_rng(seed)
    best = brute_force(instance).makespan
    for price in (None, rng.exponential(size=instance.m)):
        ascent, low = ascent_on(instance, price)
        for _ in range(40):
            ascent.round(low)
        assert ascent.proven < best * (1 + 1e-9)


def test_integrality_raises_the_bound():
    """Three agents arrive after an hour at two tasks of three hours' work: the bound is 4, or 3 if fractional."""
    instance = Instance(
        ability=[1, 1, 1],
        workload=[3, 3],
        speed=[1, 1, 1],
        agent_position=[[0, 0]] * 3,
        task_position=[[0, 1], [0, -1]],
    )
    ascent, low = ascent_on(instance)
    for _ in range(200):
        ascent.round(low)
    assert low == pytest.approx(3.0, rel=1e-4)
    assert 3.97 < ascent.proven < 4.0


def test_tasks_far_smaller_than_an_agents_work():
    """An agent's work may be any multiple of a task's need: it is capped before it is rounded to steps."""
    instance = Instance(ability=[2.8, 3.4, 10.0], workload=[1e-60, 0.0, 1e-9], speed=[np.inf, np.inf, 3.0])
    assert solve(instance, "cpsat", iterations=2, time_limit_s=None).makespan > 0
