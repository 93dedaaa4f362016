"""Limits on the size of instances."""

import numpy as np
import pytest

from alloc.allocators import Budget
from alloc.allocators.learned.play.limits import MAX_PAIRS, MAX_TASKS, NEAR, PAIRS_PER_SECOND, too_large
from alloc.problems import Instance


def sized(agents: int, tasks: int) -> Instance:
    return Instance(ability=np.ones(agents), workload=np.ones(tasks))


@pytest.mark.parametrize(
    ("agents", "tasks", "limit", "reason"),
    [
        (100, 20, 0.01, None),
        (5000, 200, 10.0, None),
        ((PAIRS_PER_SECOND - 1000) // (NEAR + 1), 100, 0.1, None),
        (3 * PAIRS_PER_SECOND, 1, 5.0, "may take 6 s"),
        (3 * PAIRS_PER_SECOND, 1, 6.0, None),
        (3 * PAIRS_PER_SECOND, 1, None, None),
        (1 + MAX_PAIRS // (NEAR + 1), 100, None, f"more than the {MAX_PAIRS // (NEAR + 1)}"),
        (1900, 1900, 8.0, "1900 agents and 1900 tasks may take 9 s"),
        (1900, 1900, 9.0, None),
        (1, MAX_TASKS, None, None),
        (1, MAX_TASKS + 1, None, f"more than the {MAX_TASKS}"),
    ],
)
def test_size_limits_depend_on_time_and_memory(
    agents: int, tasks: int, limit: float | None, reason: str | None
) -> None:
    """Small instances are never refused; large ones are if time or memory is short, with the limit in the reason."""
    said = too_large(sized(agents, tasks), Budget(time_limit_s=limit, iterations=1))
    if reason is None:
        assert said is None
    else:
        assert said is not None
        assert reason in said
        assert "local-search" in said
