"""Checks that a run leaves everything else alone: other threads, the instance, the process, the terminal."""

import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from alloc.allocators.conformance.cases import CASES, medium_case
from alloc.allocators.conformance.runner import Runner
from alloc.allocators.conformance.surroundings import changed, instance_state, process_state
from alloc.allocators.contract.base import Allocator
from alloc.problems import Allocation, Instance


class IsolationChecks(Runner):
    """What no run may change."""

    @pytest.mark.parametrize("threads", [2, 8])
    def test_threads_do_not_interfere(self, subject: Allocator, threads: int) -> None:
        """One object, used by several threads at once, answers each as it would alone.

        Global state of the process is unchanged all the time, not only afterwards: other threads use it, and of two
        overlapping runs that both restore what they found, one restores what the other had set.
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
                assert changed(before, process_state()) == [], "state of the process changed for a while"
                time.sleep(0.002)
        assert [one.result() for one in runs] == alone
        assert changed(before, process_state()) == [], "state of the process changed"

    @pytest.mark.parametrize("case", ["integer", "batteries", "zero workloads", "competing tasks", "some travel times"])
    def test_nothing_else_changes(self, subject: Allocator, case: str, capfd: pytest.CaptureFixture[str]) -> None:
        """The instance, the generators and settings shared by the process, and the terminal are left alone."""
        self.solve(subject, CASES[case])  # what is imported on first use may set itself up
        before, instance_before = process_state(), instance_state(CASES[case])
        capfd.readouterr()
        self.solve(subject, CASES[case])
        assert changed(instance_before, instance_state(CASES[case])) == [], "fields of the instance changed"
        assert changed(before, process_state()) == [], "state of the process changed"
        printed = capfd.readouterr()
        assert printed.out + printed.err == "", "an allocator prints nothing"
