"""Claims of the paper and their tests."""

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
        Quoted from the paper.
    test : str
        What is compared, in words.
    find : callable
        Returns the effect in words and the verdict.
    """

    where: str
    words: str
    test: str
    find: Callable[[Data], Finding]


CLAIMS = (
    Claim(
        "abstract",
        "consistently outperforms traditional algorithms, resulting in reduced task completion time",
        "final T of `gappo` minus each rival's, test games",
        lambda data: against_all(data, TESTS, final("makespan"), -1, "+.3f"),
    ),
    Claim(
        "abstract",
        "outperforms traditional algorithms (taken as methods that do not learn)",
        "median final T on the same instances",
        traditional,
    ),
    Claim(
        "abstract",
        "heightened energy efficiency",
        "battery after the episode, `gappo` minus each rival, in percentage points, test games",
        lambda data: against_all(data, TESTS, final("battery"), 1, "+.1f"),
    ),
    Claim(
        "abstract",
        "minimizes energy consumption across diverse configurations",
        "remaining battery if agents fly directly to their task, against methods that do not learn",
        least_energy,
    ),
    Claim(
        "abstract",
        "robust solution for real-time multi-agent task allocation",
        "-",
        unchecked("the paper gives no times"),
    ),
    Claim(
        "3.1",
        "incorporating a GA can optimize policy exploration",
        "final T with three members minus that with one, equal decisions, test games",
        population,
    ),
    Claim(
        "3.1",
        "effectively expands the policy space and enhances the diversity",
        "best T of 8 sampled games, `gappo` (members take turns) minus each rival",
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
        "first iteration with T ≤ 1.05, `gappo` minus each rival, test games; runs in which either never gets "
        "there are left out",
        lambda data: against_all(data, TESTS, reached(1.05), -1, "+.0f"),
    ),
    Claim(
        "4.1",
        "the others exhibit noticeable fluctuations, their learning is less stable",
        "mean increase of T between evaluations in the second half, `gappo` minus each rival, test games",
        lambda data: against_all(data, TESTS, fluctuation, -1, "+.4f"),
    ),
    Claim(
        "4.1",
        "advantages become increasingly apparent as the task scale expands",
        "mean final T of `gappo` minus that of the best rival",
        scale,
    ),
    Claim(
        "4.1",
        "consistently demonstrates its ability to identify optimal solutions",
        "runs whose final T equals the proven bound",
        optimal,
    ),
    Claim("4.1", "optimal completion time, by exhaustive search, is 1 hour", "lower bound and best known plan", proven),
    Claim(
        "4.1",
        "results generated from over 100 runs per scenario",
        "-",
        unchecked("the paper gives neither data nor spread"),
    ),
    Claim(
        "4.1, fig. 6",
        "battery of 91.9 % in scenario 1, others 52.2 to 55.5 %; 91.7 to 91.8 %, others 74.2 to 81.6 % after",
        "battery after the episode; the paper leaves k, the world and hops open",
        battery,
    ),
    Claim(
        "5",
        "significantly reduces task completion time while maintaining high energy levels",
        "final T of `gappo` minus each rival's, scenario 4",
        lambda data: against_all(data, 4, final("makespan"), -1, "+.3f"),
    ),
)
"""In the order of the paper."""
