"""Common part of comparisons of methods and of policies: run each on every problem with every seed."""

import logging
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import numpy as np

from alloc.problems import InputError, RefusedError
from alloc.problems.arguments import listed, of_type

LOG = logging.getLogger("alloc.compare")

P = TypeVar("P")
"""A problem: an instance, or a mission."""

M = TypeVar("M")
"""A method or a policy."""

R = TypeVar("R")
"""The result of a run."""


@dataclass(frozen=True)
class Runs(Generic[P, R]):
    """The runs of one method or policy on one problem.

    Attributes
    ----------
    number : int
        Number of the problem, from 1, as names need not be unique.
    problem : Instance or Mission
    label : str
        Label of the method or policy in the rows.
    results : list
        One per seed, up to a stop request.
    reason : str
        Why there are no results.
    """

    number: int
    problem: P
    label: str
    results: list[R]
    reason: str


def by_label(
    given: Sequence[str | M] | Mapping[str, str | M], kind: type[M], name: Callable[[M], str], place: str
) -> dict[str, str | M]:
    """Return the methods or policies by their label in the rows.

    Parameters
    ----------
    given : sequence or mapping
        Names and objects; in a mapping, by their labels.
    kind : type
        Type of the objects.
    name : callable
        Returns the label of an object.
    place : str
        Name of the parameter, for errors.

    Raises
    ------
    InputError
        If an entry is neither, or two objects of a sequence have the same label.
    """

    def checked(one: str | M) -> str | M:
        of_type(one, (str, kind), place)
        return one

    if isinstance(given, Mapping):
        return {str(label): checked(one) for label, one in given.items()}
    entries = [checked(one) for one in listed(given, place, place)]
    found = {one if isinstance(one, str) else name(one): one for one in entries}
    if len(found) < len({one if isinstance(one, str) else id(one) for one in entries}):
        raise InputError("has several objects of the same name; give a dict with a name for each", place)
    return found


def load_failure(title: str, error: Exception) -> ImportError:
    """Log why a method or policy called `title` cannot be loaded, and return the error for its rows."""
    LOG.warning("%s cannot be loaded", title, exc_info=error)
    return ImportError(f"cannot be loaded: {type(error).__name__}: {error}")


def sweep(
    run: Callable[[P, M, int], R | None],
    problems: Iterable[P],
    compared: Mapping[str, M | Exception],
    seeds: Sequence[int],
    stop: threading.Event,
) -> Iterator[Runs[P, R]]:
    """Make all runs, and yield those of each label on each problem as soon as they are complete.

    Parameters
    ----------
    run : callable
        Makes one run with a seed; returns None if it was interrupted.
    problems : iterable
    compared : mapping
        Methods or policies by label; an exception if one could not be loaded.
    seeds : sequence of int
    stop : threading.Event
        Ends the comparison when set; incomplete runs are left out.
    """
    for number, problem in enumerate(problems, 1):
        for label, one in compared.items():
            results: list[R] = []
            reason = ""
            if isinstance(one, Exception):
                reason = str(one)
            else:
                results, reason = _with_seeds(partial(run, problem, one), seeds, stop)
            if reason or results:
                yield Runs(number, problem, label, results, reason)
            if stop.is_set():
                return


def _with_seeds(run: Callable[[int], R | None], seeds: Sequence[int], stop: threading.Event) -> tuple[list[R], str]:
    """Return the results of all seeds up to a stop request, or the reason why there are none."""
    results: list[R] = []
    for seed in seeds:
        if stop.is_set():
            break
        try:
            result = run(seed)
        except RefusedError as error:
            return [], str(error)
        except Exception as error:  # a faulty plugin must not affect others
            LOG.warning("a run failed with seed %s", seed, exc_info=error)
            return [], f"failed with seed {seed}: {type(error).__name__}: {error}"
        if result is None:
            break
        results.append(result)
    return results, ""


def mean_and_worst(values: Sequence[float | None]) -> tuple[float | None, float | None]:
    """Return mean and maximum; None if there are no values or one is missing, as a mean of the rest would be biased."""
    known = [value for value in values if value is not None]
    return (float(np.mean(known)), max(known)) if known and len(known) == len(values) else (None, None)


def mean(values: Sequence[float | None]) -> float | None:
    """Return the mean; None if there are no values or one is missing."""
    return mean_and_worst(values)[0]
