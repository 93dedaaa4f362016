"""Checks that a run has no side effects on other threads, the instance, the process and the terminal."""

import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from alloc.allocators.conformance.cases import CASES, medium_case
from alloc.allocators.conformance.runner import Runner
from alloc.allocators.conformance.surroundings import changed, instance_state, process_state
from alloc.allocators.contract.base import Allocator
from alloc.problems import Allocation, Instance


class IsolationChecks(Runner):
    """Side effects that no run may have."""

    @pytest.mark.parametrize("threads", [2, 8])
    def test_threads_do_not_interfere(self, subject: Allocator, threads: int) -> None:
        """One object, used by several threads at once, gives each the same answer as if used alone.

        Global state of the process must not change even temporarily: other threads use it, and if two overlapping runs
        restore the state that they found, one of them may restore what the other had set.
        """
        instances = (CASES["ranges"], CASES["start tasks"], medium_case())
        jobs = [(instance, seed) for instance in instances for seed in (1, 2, 3)]

        def run(job: tuple[Instance, int]) -> Allocation | None:
            return self.solve(subject, job[0], seed=job[1]).allocation

        alone = self._once((subject, "alone"), lambda: [run(job) for job in jobs])
        before = process_state()
        with ThreadPoolExecutor(threads) as pool:
            runs = [pool.submit(run, job) for job in jobs]
            while not all(one.done() for one in runs):
                assert changed(before, process_state()) == [], "state of the process changed temporarily"
                time.sleep(0.002)
        assert [one.result() for one in runs] == alone
        assert changed(before, process_state()) == [], "state of the process changed"

    @pytest.mark.parametrize("case", ["integer", "batteries", "zero workloads", "competing tasks", "some travel times"])
    def test_nothing_else_changes(self, subject: Allocator, case: str, capfd: pytest.CaptureFixture[str]) -> None:
        """The instance, global random generators and settings, and the terminal are unchanged."""
        self.solve(subject, CASES[case])  # libraries that are imported on first use may initialise themselves
        before, instance_before = process_state(), instance_state(CASES[case])
        capfd.readouterr()
        self.solve(subject, CASES[case])
        assert changed(instance_before, instance_state(CASES[case])) == [], "fields of the instance changed"
        assert changed(before, process_state()) == [], "state of the process changed"
        printed = capfd.readouterr()
        assert printed.out + printed.err == "", "an allocator must not print anything"
