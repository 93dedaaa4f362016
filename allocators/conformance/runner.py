"""Loading and running of the allocator under test."""

import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, TypeVar

import pytest

from alloc.allocators.conformance.cases import CASES, medium_case
from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.improvement import Improvement
from alloc.allocators.contract.search import STANDS
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.refusal import refuse
from alloc.allocators.registry import load
from alloc.allocators.result import Result
from alloc.allocators.solve import solve
from alloc.problems import Instance, Objective, RefusedError
from alloc.problems.vocabulary import OBJECTIVES

Answer = TypeVar("Answer")

TOLERANCE = 1 + 1e-9
every_case = pytest.mark.parametrize("case", CASES)
every_objective = pytest.mark.parametrize("objective", OBJECTIVES)


class Runner:
    """Loads the allocator under test once, and runs it within a budget; see `AllocatorConformance` for attributes."""

    name: ClassVar[str] = ""
    options: ClassVar[dict[str, object]] = {}
    iterations: ClassVar[int] = 10
    patience_s: ClassVar[float] = 20.0

    def allocator(self) -> Allocator:
        """Return the allocator under test; called once, as all runs must be possible with one object."""
        return load(self.name, **self.options)

    @pytest.fixture
    def subject(self) -> Allocator:
        """Return the allocator under test, which all tests of this class share."""
        cls = type(self)
        if "_subject" not in vars(cls):
            cls._subject = self.allocator()  # type: ignore[attr-defined]
        return cls._subject  # type: ignore[attr-defined, no-any-return]

    def solve(self, subject: Allocator, instance: Instance, **settings: Any) -> Result:
        """Solve with `subject`, by default with a budget in iterations; skip the test if it refuses consistently."""
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
        assert not [note for note in result.notes if STANDS in note], "a stage failed; see the log"
        return result

    def answer(self, subject: Allocator, case: str, objective: Objective) -> Result:
        """Return the answer of `subject` to a case, which is solved once for all checks."""
        return self._once((subject, case, objective), lambda: self.solve(subject, CASES[case], objective=objective))

    def seeded_answer(self, subject: Allocator, objective: Objective) -> tuple[Result, list[Improvement]]:
        """Return the answer of `subject` to the medium case with seed 7, and its improvements; solved once."""

        def solve() -> tuple[Result, list[Improvement]]:
            reported: list[Improvement] = []
            settings = {"objective": objective, "seed": 7, "on_improvement": reported.append}
            return self.solve(subject, medium_case(), **settings), reported

        return self._once((subject, objective), solve)

    def _once(self, key: tuple[object, ...], make: Callable[[], Answer]) -> Answer:
        """Return the cached value of `make` for this key; it is called once per class."""
        cls = type(self)
        if "_answers" not in vars(cls):
            cls._answers = {}  # type: ignore[attr-defined]
        answers: dict[tuple[object, ...], Answer] = cls._answers  # type: ignore[attr-defined]
        if key not in answers:
            answers[key] = make()
        return answers[key]

    @contextmanager
    def guard(self, stop: threading.Event) -> Iterator[None]:
        """End a run that takes more than `patience_s` seconds, and fail the test."""
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
