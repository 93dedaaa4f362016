"""What the paper claims, and how we test it."""

from collections.abc import Callable
from dataclasses import dataclass

from alloc.allocators.experiments.reproduction.findings import (
    Data,
    Finding,
    against_all,
    battery,
    least_energy,
    optimal,
    population,
    proven,
    scale,
    sizes,
    traditional,
    unchecked,
)
from alloc.allocators.experiments.reproduction.protocol import TESTS
from alloc.allocators.experiments.reproduction.summary import final, fluctuation, reached


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes
    ----------
    where : str
    words : str
        A few of the paper's.
    test : str
        What we look at.
    find : callable
        What comes of it.
    """

    where: str
    words: str
    test: str
    find: Callable[[Data], Finding]


CLAIMS = (
    Claim(
        "abstract",
        "consistently outperforms traditional algorithms, resulting in reduced task completion time",
        "final T of `gappo` less that of each rival, the test games",
        lambda data: against_all(data, TESTS, final("makespan"), -1, "+.3f"),
    ),
    Claim(
        "abstract",
        "outperforms traditional algorithms (read as methods that learn nothing)",
        "median final T on the same instances",
        traditional,
    ),
    Claim(
        "abstract",
        "heightened energy efficiency",
        "battery after the episode, `gappo` less each rival, in points, the test games",
        lambda data: against_all(data, TESTS, final("battery"), 1, "+.1f"),
    ),
    Claim(
        "abstract",
        "minimizes energy consumption across diverse configurations",
        "battery left where agents fly to their task directly, against methods that learn nothing",
        least_energy,
    ),
    Claim(
        "abstract", "robust solution for real-time multi-agent task allocation", "-", unchecked("no times are given")
    ),
    Claim(
        "3.1",
        "incorporating a GA can optimize policy exploration",
        "final T with three members less that with one, the same decisions, the test games",
        population,
    ),
    Claim(
        "3.1",
        "effectively expands the policy space and enhances the diversity",
        "best T of 8 drawn games, `gappo` (its members in turn) less each rival",
        lambda data: against_all(data, TESTS, final("drawn"), -1, "+.4f"),
    ),
    Claim(
        "3.1",
        "robustness and convergence, even with varying numbers of agents",
        "T below 1.1 in every run of scenarios 2 to 4",
        sizes,
    ),
    Claim(
        "4.1",
        "decreases rapidly [...], stabilizing at a relatively low value early",
        "first iteration with T ≤ 1.05, `gappo` less each rival, the test games; without runs in which one never "
        "was there",
        lambda data: against_all(data, TESTS, reached(1.05), -1, "+.0f"),
    ),
    Claim(
        "4.1",
        "the others exhibit noticeable fluctuations, their learning is less stable",
        "mean rise of T between points in the second half, `gappo` less each rival, the test games",
        lambda data: against_all(data, TESTS, fluctuation, -1, "+.4f"),
    ),
    Claim(
        "4.1",
        "advantages become increasingly apparent as the task scale expands",
        "mean final T less the nearest rival's",
        scale,
    ),
    Claim(
        "4.1",
        "consistently demonstrates its ability to identify optimal solutions",
        "runs that end at the proven bound",
        optimal,
    ),
    Claim("4.1", "optimal completion time, by exhaustive search, is 1 hour", "bound and best plan", proven),
    Claim(
        "4.1", "results generated from over 100 runs per scenario", "-", unchecked("neither data nor spread is given")
    ),
    Claim(
        "4.1, fig. 6",
        "battery of 91.9 % in scenario 1, others 52.2 to 55.5 %; 91.7 to 91.8 %, others 74.2 to 81.6 % after",
        "battery after the episode; k, the world and hops are open in the paper",
        battery,
    ),
    Claim(
        "5",
        "significantly reduces task completion time while maintaining high energy levels",
        "final T of `gappo` less that of each rival, scenario 4",
        lambda data: against_all(data, 4, final("makespan"), -1, "+.3f"),
    ),
)
"""In the order of the paper."""
