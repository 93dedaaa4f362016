"""Checks of runs: seeds, warm starts, improvements, budgets and stop requests."""

import threading
import time
from itertools import pairwise

import numpy as np
import pytest

from alloc.allocators.conformance.cases import CASES, large_case, medium_case
from alloc.allocators.conformance.runner import Runner, every_objective
from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.improvement import Improvement
from alloc.allocators.result import Result
from alloc.problems import Allocation, Objective


class RunChecks(Runner):
    """Properties that every run must have."""

    @every_objective
    @pytest.mark.parametrize("threads", [1, 2])
    def test_same_seed_gives_same_answer(self, subject: Allocator, objective: Objective, threads: int) -> None:
        """With a budget in iterations, the answer depends on seed and number of threads, but not on the clock."""

        def solve() -> Result:
            return self.solve(subject, medium_case(), objective=objective, seed=7, threads=threads)

        first = self.seeded_answer(subject, objective)[0] if threads == 1 else solve()
        assert solve().allocation == first.allocation

    @every_objective
    def test_start_is_never_lost(self, subject: Allocator, objective: Objective) -> None:
        """The answer is no worse than the allocation that the run starts from."""
        good, _ = self.seeded_answer(subject, objective)
        assert good.allocation is not None
        assert good.evaluation is not None
        warm = self.solve(subject, medium_case(), objective=objective, start=good.allocation, iterations=1, seed=2)
        assert warm.evaluation is not None
        assert not good.evaluation.is_better_than(warm.evaluation, objective)

    def test_broken_start_is_repaired(self, subject: Allocator) -> None:
        """A start that assigns agents to tasks that they cannot do is repaired."""
        instance = CASES["ranges"]
        good = self.solve(subject, instance)
        assert good.allocation is not None
        for agent, task in np.argwhere(~instance.reach.mask[instance.reach.origin]):
            astray = good.allocation.task_of_agent.copy()
            astray[agent] = task
            result = self.solve(subject, instance, start=Allocation(astray))
            assert result.evaluation is not None
            assert result.evaluation.violations == ()
            assert result.evaluation.unserved_tasks == ()

    @every_objective
    def test_improvements_improve(self, subject: Allocator, objective: Objective) -> None:
        """Every improvement is better and later than the one before; the last is the answer; the trace has all."""
        result, reported = self.seeded_answer(subject, objective)
        assert reported, "no improvement was reported"
        assert tuple(step.figures for step in reported) == result.trace
        assert reported[-1].allocation == result.allocation
        for before, after in pairwise(reported):
            assert after.evaluation.is_better_than(before.evaluation, objective)
            assert after.time_s >= before.time_s
        assert reported[-1].time_s <= result.runtime_s

    def test_callback_can_end_the_run(self, subject: Allocator) -> None:
        """An exception from `on_improvement` propagates out of `solve`."""

        class EnoughError(Exception):
            pass

        def raise_enough(improvement: Improvement) -> None:
            raise EnoughError

        with pytest.raises(EnoughError):
            self.solve(subject, large_case(), on_improvement=raise_enough)

    @pytest.mark.parametrize("limit_s", [0.0, 0.4])
    def test_time_limit_is_held(self, subject: Allocator, limit_s: float) -> None:
        """A run exceeds its time limit by at most 10 % + 0.5 s, and has an answer even if the limit is 0."""
        instance = large_case()
        runs = (self.solve(subject, instance, iterations=None, time_limit_s=limit_s) for _ in range(2))
        first = next(runs)
        assert first.allocation is not None
        allowed = 1.1 * limit_s + 0.5
        assert first.runtime_s <= allowed or next(runs).runtime_s <= allowed  # retry, as the machine may be busy

    @pytest.mark.parametrize("budget", [{"iterations": 0}, {"target_gap": 1.0}])
    def test_empty_budget_gives_an_answer(self, subject: Allocator, budget: dict[str, float]) -> None:
        """With no iterations, or a target gap that any answer meets, there is still a feasible answer."""
        result = self.solve(subject, large_case(), **budget)
        assert result.evaluation is not None
        assert not result.evaluation.unserved_tasks

    @pytest.mark.parametrize("after_s", [0.0, 0.3])
    def test_stop_event_ends_the_run(self, subject: Allocator, after_s: float) -> None:
        """Setting the event ends a run within a second, with the best allocation so far."""

        def late_s() -> float:
            stop = threading.Event()
            timer = threading.Timer(after_s, stop.set)
            began = time.monotonic()
            timer.start()
            try:
                result = self.solve(subject, large_case(), iterations=None, time_limit_s=self.patience_s, stop=stop)
            finally:
                timer.cancel()
            assert result.allocation is not None
            return time.monotonic() - began - after_s

        # includes the bounds after the run; a second try, in case the machine is busy
        assert late_s() <= 1.5 or late_s() <= 1.5
