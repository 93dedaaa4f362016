"""How the suite loads and runs the allocator under test."""

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import pytest

from alloc.allocators.conformance.cases import CASES
from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import STANDS
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.refusal import refuse
from alloc.allocators.registry import load
from alloc.allocators.result import Result
from alloc.allocators.solve import solve
from alloc.problems import Instance, Objective, RefusedError
from alloc.problems.vocabulary import OBJECTIVES

TOLERANCE = 1 + 1e-9
every_case = pytest.mark.parametrize("case", CASES)
every_objective = pytest.mark.parametrize("objective", OBJECTIVES)


class Runner:
    """Loads the allocator under test once, and runs it within a budget; `AllocatorConformance` says what may be set."""

    name: ClassVar[str] = ""
    options: ClassVar[dict[str, object]] = {}
    iterations: ClassVar[int] = 10
    patience_s: ClassVar[float] = 20.0

    def allocator(self) -> Allocator:
        """Return the allocator under test; called once, as one object must serve all runs."""
        return load(self.name, **self.options)

    @pytest.fixture
    def subject(self) -> Allocator:
        """Return the one allocator of this class."""
        cls = type(self)
        if "_subject" not in vars(cls):
            cls._subject = self.allocator()  # type: ignore[attr-defined]
        return cls._subject  # type: ignore[attr-defined, no-any-return]

    def solve(self, subject: Allocator, instance: Instance, **settings: Any) -> Result:
        """Solve by `subject`, with a budget in iterations by default; skip what it refuses, if it has reason to."""
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
        """Return the answer of `subject` to a case, solved once for all checks."""
        cls = type(self)
        if "_answers" not in vars(cls):
            cls._answers = {}  # type: ignore[attr-defined]
        answers: dict[tuple[Allocator, str, Objective], Result] = cls._answers  # type: ignore[attr-defined]
        if (subject, case, objective) not in answers:
            answers[subject, case, objective] = self.solve(subject, CASES[case], objective=objective)
        return answers[subject, case, objective]

    @contextmanager
    def guard(self, stop: threading.Event) -> Iterator[None]:
        """End a run that takes more than `patience_s`, and let the check fail."""
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
