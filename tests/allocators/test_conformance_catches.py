"""The suite fails allocators that break the contract: one defect at a time, in an allocator that otherwise passes."""

import os
import random
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from alloc.allocators import Allocator, Method, Proposal
from alloc.allocators.conformance import AllocatorConformance
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Allocation, Objective, evaluate, serve_all

PLAIN = Method(name="sound", summary="tries random allocations", finite_speeds=True, makespan_slack=True)


class Sound(Allocator):
    """Random restarts, as the contract asks; the base of every defect below."""

    method = PLAIN

    def allocate(self, search):
        rng = self.generator(search)
        search.submit(self.draw(search.instance, rng))
        while not search.should_stop():
            search.iteration += 1
            search.submit(self.draw(search.instance, rng))
        return self.conclude(search)

    def generator(self, search):
        return np.random.default_rng(search.seed)

    def draw(self, instance, rng):
        task = np.array([rng.choice([-1, *np.flatnonzero(row)]) for row in instance.reach.mask[instance.reach.origin]])
        return serve_all(instance, Allocation(task))

    def conclude(self, search):
        return Proposal()


class BadName(Sound):
    method = replace(PLAIN, name="My Method")


class NoSummary(Sound):
    method = replace(PLAIN, summary=" ")


class NotMakespan(Sound):
    method = replace(PLAIN, objectives=(Objective.MAKESPAN_ENERGY,))


class NotInstalled(Sound):
    method = replace(PLAIN, requires=("no_such_module",))


class RefusesAll(Sound):
    def refusal(self, instance, objective, budget):
        return "never in the mood"


class Herd(Sound):
    """Sends everybody to the first task."""

    def allocate(self, search):
        return Proposal(Allocation(np.zeros(search.instance.n, dtype=int)))


class Astray(Sound):
    """Sends one agent where it cannot go, though every task is served without it."""

    def allocate(self, search):
        instance = search.instance
        for agent, task in zip(*np.nonzero(~instance.reach.mask[instance.reach.origin]), strict=True):
            choice = greedy(instance).task_of_agent.copy()
            choice[agent] = task
            if not evaluate(instance, Allocation(choice)).unserved_tasks:
                return Proposal(Allocation(choice))
        return super().allocate(search)


class Nothing(Sound):
    def allocate(self, search):
        return Proposal()


class Flatterer(Sound):
    """Reports the scores of an allocation in which all does for free."""

    def conclude(self, search):
        search.best = replace(search.best, evaluation=replace(search.best.evaluation, energy=-1.0))
        return Proposal()


class BoastsMakespan(Sound):
    """Takes its own answer for the best there is."""

    def allocate(self, search):
        answer = serve_all(search.instance, greedy(search.instance))
        return Proposal(answer, makespan_lower_bound=evaluate(search.instance, answer).makespan)


class BoastsEnergy(Sound):
    def conclude(self, search):
        return Proposal(None, energy_lower_bound=search.best.evaluation.energy * 1.01 + 1)


class Unseeded(Sound):
    def generator(self, search):
        return np.random.default_rng()


class CountsNothing(Sound):
    """Goes on until time is up, whatever its iterations."""

    def allocate(self, search):
        while search.remaining_s > 0 and not search.interrupted:
            time.sleep(0.01)
        return Proposal(serve_all(search.instance, greedy(search.instance)))


class Forgetful(Sound):
    """Throws the start away."""

    def allocate(self, search):
        if search.start is None:
            return super().allocate(search)
        search.best = None
        return Proposal(Allocation.idle(search.instance))


class Chatterer(Sound):
    """Tells the same answer twice as an improvement."""

    def conclude(self, search):
        best = search.best
        search.best = None
        search.submit(best.allocation)
        return Proposal()


class Stubborn(Sound):
    """Lets nothing that the callback raises through."""

    def allocate(self, search):
        try:
            search.submit(serve_all(search.instance, greedy(search.instance)))
        except Exception:
            return Proposal()
        return Proposal()


class Slow(Sound):
    """Does not look at the clock for a second."""

    def allocate(self, search):
        time.sleep(1)
        return Proposal(serve_all(search.instance, greedy(search.instance)))


class Deaf(Sound):
    """Hears of the time limit alone."""

    def allocate(self, search):
        while search.remaining_s > 0:
            time.sleep(0.01)
        return Proposal(serve_all(search.instance, greedy(search.instance)))


class LazyWithoutBudget(Sound):
    def allocate(self, search):
        return Proposal() if search.should_stop() else super().allocate(search)


class Shared(Sound):
    """Keeps its generator where the next thread puts its own."""

    def generator(self, search):
        self.rng = super().generator(search)
        return self.rng

    def draw(self, instance, rng):
        time.sleep(0.001)
        return super().draw(instance, self.rng)


class SeedsForAWhile(Sound):
    """Seeds the global generator, and puts it back as it was."""

    def allocate(self, search):
        before = random.getstate()
        random.seed(search.seed)
        try:
            time.sleep(0.01)
            return super().allocate(search)
        finally:
            random.setstate(before)


class SetsTorchThreadsForAWhile(Sound):
    """Gives torch another number of threads, and then the one that it met."""

    def allocate(self, search):
        import torch

        before = torch.get_num_threads()
        torch.set_num_threads(before + 1)
        try:
            time.sleep(0.01)
            return super().allocate(search)
        finally:
            torch.set_num_threads(before)


class SetsEnvironmentForAWhile(Sound):
    """Sets a variable of the environment, and removes it."""

    def allocate(self, search):
        os.environ["ALLOC_RUNS"] = "1"
        try:
            time.sleep(0.01)
            return super().allocate(search)
        finally:
            os.environ.pop("ALLOC_RUNS", None)


class FailsAtTheEnd(Sound):
    """Fails where `improving` saves the plan at hand."""

    def conclude(self, search):
        with search.improving("polishing"):
            raise ZeroDivisionError
        return Proposal()


class Meddler(Sound):
    """Writes into the instance."""

    def draw(self, instance, rng):
        instance.workload.setflags(write=True)
        instance.workload[0] += 1e-12
        return super().draw(instance, rng)


class DrawsGlobally(Sound):
    def draw(self, instance, rng):
        random.random()
        return super().draw(instance, rng)


class SeedsGlobally(Sound):
    def generator(self, search):
        np.random.seed(np.random.randint(1 << 30))  # noqa: NPY002 (the defect)
        return super().generator(search)


class SeedsTorch(Sound):
    def generator(self, search):
        import torch

        torch.rand(1)
        return super().generator(search)


class SetsEnvironment(Sound):
    def draw(self, instance, rng):
        os.environ["ALLOC_RUNS"] = str(int(os.environ.get("ALLOC_RUNS", "0")) + 1)
        return super().draw(instance, rng)


class Talker(Sound):
    def draw(self, instance, rng):
        print("working on it")
        return super().draw(instance, rng)


class NativeTalker(Sound):
    """Prints past `sys.stdout`, as solvers in native code do."""

    def draw(self, instance, rng):
        os.write(2, b"presolve ...\n")
        return super().draw(instance, rng)


MAKESPAN, ENERGY = Objective.MAKESPAN, Objective.MAKESPAN_ENERGY
DEFECTS = [
    (BadName, "test_method_is_described", ()),
    (NoSummary, "test_method_is_described", ()),
    (NotMakespan, "test_method_is_described", ()),
    (NotInstalled, "test_method_is_described", ()),
    (RefusesAll, "test_plain_instance_is_not_refused", ()),
    (Herd, "test_proposal_is_sound", ("ranges",)),
    (Nothing, "test_proposal_is_sound", ("integer",)),
    (Astray, "test_answer_is_sound", ("ranges", MAKESPAN)),
    (Nothing, "test_answer_is_sound", ("integer", MAKESPAN)),
    (Flatterer, "test_answer_is_sound", ("integer", ENERGY)),
    (BoastsMakespan, "test_claims_hold", ("batteries", MAKESPAN)),
    (BoastsEnergy, "test_claims_hold", ("integer", ENERGY)),
    (BoastsEnergy, "test_slack_is_spent_on_energy", ("integer",)),
    (Unseeded, "test_same_seed_gives_same_answer", (MAKESPAN, 1)),
    (CountsNothing, "test_same_seed_gives_same_answer", (MAKESPAN, 1)),
    (Forgetful, "test_start_is_never_lost", (MAKESPAN,)),
    (Astray, "test_broken_start_is_repaired", ()),
    (Chatterer, "test_improvements_improve", (MAKESPAN,)),
    (Stubborn, "test_callback_can_end_the_run", ()),
    (Slow, "test_time_limit_is_held", (0.0,)),
    (Nothing, "test_time_limit_is_held", (0.0,)),
    (LazyWithoutBudget, "test_empty_budget_gives_an_answer", ({"iterations": 0},)),
    (CountsNothing, "test_empty_budget_gives_an_answer", ({"iterations": 0},)),
    (Deaf, "test_stop_event_ends_the_run", (0.0,)),
    (FailsAtTheEnd, "test_answer_is_sound", ("integer", MAKESPAN)),
    (Shared, "test_threads_do_not_interfere", (2,)),
    (Shared, "test_threads_do_not_interfere", (8,)),
    (SeedsForAWhile, "test_threads_do_not_interfere", (2,)),
    (SetsTorchThreadsForAWhile, "test_threads_do_not_interfere", (2,)),
    (SetsEnvironmentForAWhile, "test_threads_do_not_interfere", (2,)),
    (Meddler, "test_nothing_else_changes", ("integer",)),
    (DrawsGlobally, "test_nothing_else_changes", ("integer",)),
    (SeedsGlobally, "test_nothing_else_changes", ("integer",)),
    (SeedsTorch, "test_nothing_else_changes", ("integer",)),
    (SetsEnvironment, "test_nothing_else_changes", ("integer",)),
    (Talker, "test_nothing_else_changes", ("integer",)),
    (NativeTalker, "test_nothing_else_changes", ("integer",)),
]
CHECKS = {name for name in dir(AllocatorConformance) if name.startswith("test_")}


class Suite(AllocatorConformance):
    patience_s = 2.0


class ImpatientSuite(AllocatorConformance):
    """For those that end only when patience does."""

    patience_s = 0.5


def run_check(allocator, check, arguments, capfd):
    """Call one check as pytest would."""
    extra = {"capfd": capfd} if check == "test_nothing_else_changes" else {}
    suite = ImpatientSuite() if isinstance(allocator, CountsNothing) else Suite()
    getattr(suite, check)(allocator, *arguments, **extra)


@pytest.fixture
def clean_instances(monkeypatch):
    """Undo what a defect does to the process and to the instances of the suite."""
    from alloc.allocators.conformance.cases import CASES

    kept = CASES["integer"].workload.copy()
    monkeypatch.delenv("ALLOC_RUNS", raising=False)
    yield
    CASES["integer"].workload.setflags(write=True)
    CASES["integer"].workload[:] = kept
    CASES["integer"].workload.setflags(write=False)
    os.environ.pop("ALLOC_RUNS", None)


@pytest.fixture
def torch_threads():
    """Put back what a defect leaves torch with."""
    import torch

    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


@pytest.mark.usefixtures("clean_instances", "torch_threads")
@pytest.mark.parametrize(("defect", "check", "arguments"), DEFECTS, ids=[f"{d.__name__}-{c}" for d, c, _ in DEFECTS])
def test_defect_is_caught(defect, check, arguments, capfd):
    """An allocator with this defect fails the check."""
    with pytest.raises((AssertionError, pytest.fail.Exception)):
        run_check(defect(), check, arguments, capfd)


@pytest.mark.parametrize(("check", "arguments"), [(c, a) for _, c, a in DEFECTS], ids=lambda value: str(value))
def test_sound_allocator_passes(check, arguments, capfd):
    """The same allocator without the defect passes, so that the failure is due to the defect."""
    run_check(Sound(), check, arguments, capfd)


def test_every_check_can_fail():
    """Each check of the suite detects some defect."""
    assert {check for _, check, _ in DEFECTS} == CHECKS


def test_refusals_are_verified():
    """A method that refuses travel times skips those checks, but fails if `solve` accepts them after all."""

    class Refusing(Sound):
        method = replace(PLAIN, finite_speeds=False)

    with pytest.raises(pytest.skip.Exception, match="finite speeds"):
        Suite().test_answer_is_sound(Refusing(), "travel times", MAKESPAN)


def test_only_the_suite_imports_pytest():
    """Importing the allocators does not import pytest."""
    import subprocess

    code = "import sys, alloc.allocators; sys.exit('pytest' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
