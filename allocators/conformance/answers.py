"""Checks of single answers: allocations are feasible, scores are correct, and claims hold."""

import re

import pytest

from alloc.allocators.conformance.cases import CASES, least_energy, optimum
from alloc.allocators.conformance.runner import TOLERANCE, Runner, every_case, every_objective
from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.status import Status
from alloc.allocators.contract.tolerance import PROVEN
from alloc.problems import Objective, evaluate, fewest_unserved


class AnswerChecks(Runner):
    """Properties that every answer must have."""

    def test_method_is_described(self, subject: Allocator) -> None:
        """Name, summary, objectives and requirements are valid, so that ``alloc methods`` can show them."""
        method = subject.method
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", method.name), "lower-case letters, digits and hyphens"
        assert method.summary.strip(), "the summary is empty"
        assert "\n" not in method.summary, "the summary has more than one line"
        assert set(method.objectives) <= set(Objective)
        assert Objective.MAKESPAN in method.objectives, "every method minimises the makespan"
        assert not method.missing, f"requires {method.missing}, which is not installed"

    def test_plain_instance_is_not_refused(self, subject: Allocator) -> None:
        """A method may refuse what it does not support, but not a small instance without special features."""
        assert subject.refusal(CASES["integer"], Objective.MAKESPAN, Budget()) is None

    @every_case
    def test_proposal_is_sound(self, subject: Allocator, case: str) -> None:
        """Before any repair by `solve`, there is an answer in which every agent can do its task."""
        self.answer(subject, case, subject.method.objectives[0])  # skips refused cases
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
        """Scores match the allocation, agents can do their tasks, and the fewest and least urgent are unserved."""
        instance = CASES[case]
        result = self.answer(subject, case, objective)
        assert result.allocation is not None, "no allocation, although one exists"
        assert result.evaluation is not None, "an allocation without scores"
        again = evaluate(instance, result.allocation)
        assert result.evaluation.key(Objective.MAKESPAN_ENERGY) == again.key(Objective.MAKESPAN_ENERGY)
        assert result.evaluation.energy == again.energy
        assert result.evaluation.violations == ()
        assert len(again.unserved_tasks) == fewest_unserved(instance)
        best = optimum(case, objective)
        assert again.unserved_rank == best.unserved_rank, "more urgent tasks could be served"
        assert not again.is_better_than(best, objective), "better than the optimum; the suite or `evaluate` is wrong"

    @every_case
    @every_objective
    def test_claims_hold(self, subject: Allocator, case: str, objective: Objective) -> None:
        """Bounds do not exceed the optimum found by enumeration, and the status claims no more than they prove."""
        result, best = self.answer(subject, case, objective), optimum(case, objective)
        assert result.evaluation is not None
        if best.unserved_tasks:
            assert result.status is Status.INFEASIBLE
            assert result.lower_bound is None
            return
        assert best.makespan is not None
        assert result.makespan is not None
        assert result.lower_bound is not None
        assert result.lower_bound <= best.makespan * TOLERANCE, "the bound on the makespan exceeds the optimum"
        if result.energy_lower_bound is not None:
            least = least_energy(case, result.makespan)
            assert result.energy_lower_bound <= least * TOLERANCE, "the bound on the energy exceeds the optimum"
        assert result.status in (Status.OPTIMAL, Status.FEASIBLE)
        if result.status is Status.OPTIMAL:
            assert result.makespan <= best.makespan * (1 + 2 * PROVEN)

    @every_case
    def test_slack_is_spent_on_energy(self, subject: Allocator, case: str) -> None:
        """With makespan slack, the answer keeps to the makespan limit, and the energy bound holds under that limit."""
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
