"""The checks that `AllocatorConformance` runs."""

import re
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import pytest

from alloc.allocators.conformance.cases import CASES, large_case, least_energy, medium_case, optimum
from alloc.allocators.conformance.surroundings import instance_state, process_state
from alloc.allocators.contract.base import Allocator, Proposal, RefusedError
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import STANDS, Improvement, Search
from alloc.allocators.contract.tolerance import PROVEN, MakespanTolerance
from alloc.allocators.registry import load
from alloc.allocators.result import Result, Status
from alloc.allocators.solve import refuse, solve
from alloc.problems import Allocation, Instance, Objective, evaluate, fewest_unserved

TOLERANCE = 1 + 1e-9
every_case = pytest.mark.parametrize("case", CASES)
every_objective = pytest.mark.parametrize("objective", list(Objective))


class AllocatorConformance:
    """What the contract of `Allocator` asks for, as tests; subclass it as ``class TestMine(AllocatorConformance)``.

    Give the subclass either `name` or a method `allocator`. Instances that the method refuses, as its `Method` or its
    `refusal` says, are checked to be refused.

    Attributes
    ----------
    name : str
        What to load; not needed where `allocator` is overridden.
    options : dict
        Options to load it with.
    iterations : int
        Budget where answers must be reproducible; choose it so that a run takes some 50 ms.
    patience_s : float
        What no run may take, as all have either few iterations or a short time limit.
    """

    name: ClassVar[str] = ""
    options: ClassVar[dict[str, Any]] = {}
    iterations: ClassVar[int] = 10
    patience_s: ClassVar[float] = 20.0

    def allocator(self) -> Allocator:
        """Return the allocator under test; called once, for one object must serve all runs."""
        return load(self.name, **self.options)

    @pytest.fixture
    def subject(self) -> Allocator:
        """Return the one allocator of this class."""
        cls = type(self)
        if "_subject" not in vars(cls):
            cls._subject = self.allocator()  # type: ignore[attr-defined]
        return cls._subject  # type: ignore[attr-defined, no-any-return]

    def solve(self, subject: Allocator, instance: Instance, **settings: Any) -> Result:
        """Solve by `subject` with a budget of iterations unless told otherwise; skip what it rightly refuses."""
        objective = Objective(settings.pop("objective", subject.method.objectives[0]))
        settings = {"iterations": self.iterations, "time_limit_s": None, "threads": 1, **settings}
        budget = Budget(settings["time_limit_s"], settings["iterations"])
        try:
            refuse(subject, instance, objective, budget, MakespanTolerance(settings.get("makespan_slack", 0.0)))
        except RefusedError as refused:
            with pytest.raises(RefusedError, match=re.escape(str(refused))):
                solve(instance, subject, objective=objective, **settings)
            pytest.skip(f"{subject.method.name}: {str(refused).partition(': ')[2]}")
        with self.guard(settings.setdefault("stop", threading.Event())):
            result = solve(instance, subject, objective=objective, **settings)
        assert not [note for note in result.notes if STANDS in note], "a stage failed; the log tells where"
        return result

    def answer(self, subject: Allocator, case: str, objective: Objective) -> Result:
        """Return what `subject` answers to a case, solved once for all checks that ask."""
        cls = type(self)
        if "_answers" not in vars(cls):
            cls._answers = {}  # type: ignore[attr-defined]
        answers: dict[tuple[Allocator, str, Objective], Result] = cls._answers  # type: ignore[attr-defined]
        if (subject, case, objective) not in answers:
            answers[subject, case, objective] = self.solve(subject, CASES[case], objective=objective)
        return answers[subject, case, objective]

    @contextmanager
    def guard(self, stop: threading.Event) -> Iterator[None]:
        """End a run that takes more than `patience_s`, and fail."""
        late = threading.Event()

        def end_it() -> None:
            late.set()
            stop.set()

        timer = threading.Timer(self.patience_s, end_it)
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
        assert not late.is_set(), f"the run went on for {self.patience_s} s, far beyond its budget"

    def test_method_is_described(self, subject: Allocator) -> None:
        """Name, summary, objectives and needs are such that ``alloc methods`` can show them."""
        method = subject.method
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", method.name), "lower-case letters, digits and hyphens"
        assert method.summary.strip(), "the summary is empty"
        assert "\n" not in method.summary, "the summary has more than one line"
        assert set(method.objectives) <= set(Objective)
        assert Objective.MAKESPAN in method.objectives, "every method minimises the makespan"
        assert not method.missing, f"requires {method.missing}, which is not installed"

    def test_plain_instance_is_not_refused(self, subject: Allocator) -> None:
        """A method may refuse what it cannot do, but not a small instance without anything special."""
        assert subject.refusal(CASES["integer"], Objective.MAKESPAN, Budget()) is None

    @every_case
    def test_proposal_is_sound(self, subject: Allocator, case: str) -> None:
        """Before `solve` mends anything, there is an answer, and it sends nobody where he cannot go."""
        self.answer(subject, case, subject.method.objectives[0])  # skips what is refused
        search = Search(CASES[case], subject.method.objectives[0], Budget(None, self.iterations))
        proposal = subject.allocate(search)
        assert isinstance(proposal, Proposal)
        if proposal.allocation is not None:
            search.submit(proposal.allocation)
            assert evaluate(CASES[case], proposal.allocation).violations == ()
        assert search.best is not None, "neither proposed nor submitted an allocation"
        assert search.best.evaluation.violations == ()

    @every_case
    @every_objective
    def test_answer_is_sound(self, subject: Allocator, case: str, objective: Objective) -> None:
        """The scores are those of the allocation, nobody is sent astray, and as few tasks as possible are unserved."""
        instance = CASES[case]
        result = self.answer(subject, case, objective)
        assert result.allocation is not None, "no allocation, though any would do"
        assert result.evaluation is not None, "an allocation without scores"
        again = evaluate(instance, result.allocation)
        assert result.evaluation.key(Objective.MAKESPAN_ENERGY) == again.key(Objective.MAKESPAN_ENERGY)
        assert result.evaluation.violations == ()
        assert len(again.unserved_tasks) == fewest_unserved(instance)
        best = optimum(case, objective)
        assert not again.is_better_than(best, objective), "better than the optimum; the suite or `evaluate` is wrong"

    @every_case
    @every_objective
    def test_claims_hold(self, subject: Allocator, case: str, objective: Objective) -> None:
        """Bounds lie below the optimum found by trying everything, and the status says no more than they prove."""
        result, best = self.answer(subject, case, objective), optimum(case, objective)
        assert result.evaluation is not None
        if best.unserved_tasks:
            assert result.status is Status.INFEASIBLE
            assert result.lower_bound is None
            return
        assert best.makespan is not None
        assert result.makespan is not None
        assert result.lower_bound is not None
        assert result.lower_bound <= best.makespan * TOLERANCE, "the makespan is proven to be more than it can be"
        if result.energy_lower_bound is not None:
            least = least_energy(case, result.makespan)
            assert result.energy_lower_bound <= least * TOLERANCE, "the energy is proven to be more than it can be"
        assert result.status in (Status.OPTIMAL, Status.FEASIBLE)
        if result.status is Status.OPTIMAL:
            assert result.makespan <= best.makespan * (1 + 2 * PROVEN)

    @every_case
    def test_slack_is_spent_on_energy(self, subject: Allocator, case: str) -> None:
        """With slack for the makespan, nothing beyond it is taken, and the bound on the energy holds within it."""
        result = self.solve(subject, CASES[case], objective=Objective.MAKESPAN_ENERGY, makespan_slack=0.5)
        score, fastest = result.evaluation, optimum(case, Objective.MAKESPAN).makespan
        assert score is not None
        if fastest is None:
            assert result.makespan_limit is None
            return
        limit = result.makespan_limit
        assert limit is not None
        assert score.makespan is not None
        assert score.makespan <= limit * TOLERANCE
        assert (result.energy_lower_bound or 0.0) <= least_energy(case, limit) * TOLERANCE
        if result.status is Status.OPTIMAL:
            assert score.energy == pytest.approx(least_energy(case, 1.5 * fastest), rel=2 * PROVEN)

    @every_objective
    def test_same_seed_gives_same_answer(self, subject: Allocator, objective: Objective) -> None:
        """With a budget of iterations, the seed alone decides; the clock does not."""
        first = self.solve(subject, medium_case(), objective=objective, seed=7)
        again = self.solve(subject, medium_case(), objective=objective, seed=7)
        assert first.allocation == again.allocation

    @every_objective
    def test_start_is_never_lost(self, subject: Allocator, objective: Objective) -> None:
        """The answer is no worse than the allocation that the run starts from."""
        good = self.solve(subject, medium_case(), objective=objective, seed=1)
        assert good.allocation is not None
        assert good.evaluation is not None
        warm = self.solve(subject, medium_case(), objective=objective, start=good.allocation, iterations=1, seed=2)
        assert warm.evaluation is not None
        assert not good.evaluation.is_better_than(warm.evaluation, objective)

    def test_broken_start_is_mended(self, subject: Allocator) -> None:
        """A start that sends agents where they can no longer go does no harm."""
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
        """Every improvement told is better than the one before and later; the last is the answer, the trace is all."""
        told: list[Improvement] = []
        result = self.solve(subject, medium_case(), objective=objective, on_improvement=told.append)
        assert told, "nothing was told"
        assert tuple(told) == result.trace
        assert told[-1].allocation == result.allocation
        for before, after in pairwise(told):
            assert after.evaluation.is_better_than(before.evaluation, objective)
            assert after.time_s >= before.time_s
        assert told[-1].time_s <= result.runtime_s

    def test_callback_can_end_the_run(self, subject: Allocator) -> None:
        """What `on_improvement` raises comes out of `solve`."""

        class EnoughError(Exception):
            pass

        def raise_enough(improvement: Improvement) -> None:
            raise EnoughError

        with pytest.raises(EnoughError):
            self.solve(subject, large_case(), on_improvement=raise_enough)

    @pytest.mark.parametrize("limit_s", [0.0, 0.4])
    def test_time_limit_is_held(self, subject: Allocator, limit_s: float) -> None:
        """A run takes at most 10 % + 0.5 s more than its limit, and answers even where the limit is 0."""
        instance = large_case()
        runs = (self.solve(subject, instance, iterations=None, time_limit_s=limit_s) for _ in range(2))
        first = next(runs)
        assert first.allocation is not None
        allowed = 1.1 * limit_s + 0.5
        assert first.runtime_s <= allowed or next(runs).runtime_s <= allowed  # one more try, for a busy machine

    @pytest.mark.parametrize("budget", [{"iterations": 0}, {"target_gap": 1.0}])
    def test_empty_budget_gives_an_answer(self, subject: Allocator, budget: dict[str, Any]) -> None:
        """No iterations at all, or a gap that any answer has, still give a sound answer at once."""
        result = self.solve(subject, large_case(), **budget)
        assert result.evaluation is not None
        assert not result.evaluation.unserved_tasks

    @pytest.mark.parametrize("after_s", [0.0, 0.3])
    def test_stop_event_ends_the_run(self, subject: Allocator, after_s: float) -> None:
        """Setting the event ends a run within a second, with the best so far."""

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

        # the certificate after the run included; one more try, for a busy machine
        assert late_s() <= 1.5 or late_s() <= 1.5

    @pytest.mark.parametrize("threads", [2, 8])
    def test_threads_do_not_meet(self, subject: Allocator, threads: int) -> None:
        """One object, used by several threads at once, answers each as it would alone.

        What the process has but once is as before all the while, not only afterwards: others use it, and of two runs
        that overlap, each of which puts back what it met, one puts back what the other had set.
        """
        instances = (CASES["ranges"], CASES["start tasks"], medium_case())
        jobs = [(instance, seed) for instance in instances for seed in (1, 2, 3)]

        def run(job: tuple[Instance, int]) -> Allocation | None:
            return self.solve(subject, job[0], seed=job[1]).allocation

        alone = [run(job) for job in jobs]
        before = process_state()
        with ThreadPoolExecutor(threads) as pool:
            runs = [pool.submit(run, job) for job in jobs]
            while not all(one.done() for one in runs):
                assert changed(before, process_state()) == [], "state of the process changed for a while"
                time.sleep(0.002)
        assert [one.result() for one in runs] == alone
        assert changed(before, process_state()) == [], "state of the process changed"

    @pytest.mark.parametrize("case", ["integer", "batteries", "zero workloads", "contested agent", "some travel times"])
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


def changed(before: dict[str, object], after: dict[str, object]) -> list[str]:
    """Return the names whose values differ."""
    return [name for name in before if before[name] != after.get(name)]
