"""Reproduction of the paper's experiments: rows survive crashes, and the page is generated only from them."""

import math
import os
import shutil
import threading
from dataclasses import fields, replace
from pathlib import Path

import pytest
import torch

from alloc.allocators.experiments.reproduction import folder as module
from alloc.allocators.experiments.reproduction import learning, others
from alloc.allocators.experiments.reproduction.claims import CLAIMS
from alloc.allocators.experiments.reproduction.findings import (
    HOLDS,
    NOT,
    TOO_FEW,
    UNKNOWN,
    Data,
    battery,
    least_energy,
    optimal,
    proven,
    sizes,
    traditional,
)
from alloc.allocators.experiments.reproduction.folder import Folder
from alloc.allocators.experiments.reproduction.page import page
from alloc.allocators.experiments.reproduction.protocol import (
    ABLATIONS,
    OTHERS,
    PAPER_METHODS,
    SCENARIOS,
    TESTS,
    VARIANTS,
    Job,
    expected,
    planned,
)
from alloc.allocators.experiments.reproduction.rows import Learned, Solved, append, begin, read
from alloc.allocators.experiments.reproduction.summary import effect, final, fluctuation, reached, runs_of
from alloc.allocators.learned.algorithms.genes import GeneticPpo
from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.parallel.serial import SerialEngine
from alloc.problems import InputError, makespan_lower_bound
from alloc.problems.generate.paper_scenarios import paper_like

DOCS = Path(__file__).parents[4] / "docs"

ROW = Learned("gappo", 0, 300, 300, TESTS, 60_000, 90_000, 1.02, 1.0, 0.0, 92.0, 0.4, 0.2, 1.0, 40.0)


def history(method: str, run: int, *makespans: float, scenario: int = TESTS) -> list[Learned]:
    """Rows of a run, judged every 100 iterations."""
    return [
        replace(ROW, method=method, run=run, scenario=scenario, iteration=100 * number, makespan=makespan)
        for number, makespan in enumerate(makespans)
    ]


def rows_of(job: Job) -> list[Learned]:
    """All rows of a run, made without training."""
    return [
        replace(ROW, method=job.method, run=job.run, scenario=scenario, iteration=iteration)
        for scenario, iteration in sorted(expected(job))
    ]


def test_shipped_page_matches_the_shipped_rows() -> None:
    """docs/reproduction.md equals, byte for byte, the page generated from the rows beside it."""
    assert Folder(DOCS).text() == (DOCS / "reproduction.md").read_text("utf-8")


def test_rows_are_read_back_without_truncated_lines(tmp_path: Path) -> None:
    """Appended rows are read back, including infinite and missing values; a line truncated by a crash is skipped."""
    path = tmp_path / "rows.csv"
    assert read(path, Learned) == []
    begin(path, Learned)
    begin(path, Learned)
    append(path, [ROW, replace(ROW, makespan=math.inf)])
    with path.open("a") as file:
        file.write("gappo,1,300,3")
    assert read(path, Learned) == [ROW, replace(ROW, makespan=math.inf)]
    with pytest.raises(InputError, match="must have the columns method, run, scenario"):
        read(path, Solved)


def test_only_missing_runs_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interrupted reproduction keeps completed runs and makes the others."""
    stop, made = threading.Event(), []

    def make_run(data: Path, job: Job) -> None:
        made.append(job)
        append(data / "learning.csv", rows_of(job))
        if len(made) == 3:
            stop.set()

    monkeypatch.setattr(module, "make_run", make_run)
    jobs = planned(2, ("gappo", "ppo"), 300, 1.0)
    place = Folder(tmp_path / "out")
    assert not place.make(jobs, SerialEngine(), stop.is_set)
    assert place.missing(jobs) == [Job(1, "ppo")]
    assert place.make(jobs, SerialEngine())
    assert made == jobs
    assert len(place.environments) == 1


@pytest.mark.parametrize("lost", [1, 2, 9, 60])
def test_truncated_run_is_repeated(tmp_path: Path, lost: int) -> None:
    """A run truncated within a line or at its end is missing and repeated; rows appended afterwards are complete."""
    place, jobs = Folder(tmp_path), [Job(0, "gappo"), Job(1, "gappo"), Job(2, "gappo")]
    place.data.mkdir()
    path = place.data / "learning.csv"
    begin(path, Learned)
    append(path, rows_of(jobs[0]))
    append(path, rows_of(jobs[1]))
    text = path.read_bytes()
    path.write_bytes(text[: text[:-1].rindex(b"\n") + 1] if lost == 60 else text[:-lost])
    assert place.missing(jobs) == jobs[1:]
    append(path, rows_of(jobs[2]))
    assert place.missing(jobs) == [jobs[1]]
    assert str(place.learned) == str(rows_of(jobs[0]) + rows_of(jobs[2]))
    append(path, rows_of(jobs[1]))
    assert place.missing(jobs) == []
    assert len(place.learned) == 3 * len(expected(jobs[0]))


def test_partially_written_rows_are_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the system writes only a part of the rows, the run does not count as made."""
    write = os.write
    monkeypatch.setattr(os, "write", lambda handle, data: write(handle, data[:20]))
    with pytest.raises(OSError, match="only a part of the rows"):
        append(tmp_path / "rows.csv", [ROW])


def test_figures_and_page_are_made_from_rows(tmp_path: Path) -> None:
    """Five figures and the page are written even if some methods have no runs; without any run there is an error."""
    place = Folder(tmp_path)
    with pytest.raises(InputError, match="holds no runs"):
        place.publish()
    place.data.mkdir()
    for name in ("learning.csv", "others.csv"):
        shutil.copy(DOCS / "reproduction" / name, place.data / name)
    kept = [row for row in place.learned if row.method in ("gappo", "ppo") and row.run == 0]
    (place.data / "learning.csv").unlink()
    begin(place.data / "learning.csv", Learned)
    append(place.data / "learning.csv", kept)
    place.publish()
    assert all((place.data / f"figure-{number}.png").stat().st_size > 5000 for number in range(2, 7))
    assert "some methods have only 1 here.**" in place.page.read_text("utf-8")


def test_effects_match_hand_calculation() -> None:
    """Differences are paired by run; runs without a value are excluded; increases alone count as fluctuation."""
    rows = [*history("gappo", 0, 2.0, 1.1, 1.0), *history("ppo", 0, 2.0, 1.0, 1.1), *history("gappo", 1, 2.0, 1.5, 1.2)]
    one = effect(rows, "gappo", "ppo", final("makespan"))
    assert one is not None
    assert (one.runs, one.mean, one.low, one.p) == (1, pytest.approx(-0.1), None, None)
    assert effect(rows, "gappo", "a2c", final("makespan")) is None
    first, second = runs_of(rows, "gappo")
    assert reached(1.1)(first) == 100
    assert reached(1.1)(second) == math.inf
    assert fluctuation(runs_of(rows, "ppo")[0]) == pytest.approx(0.1)
    assert fluctuation(first) == 0


def test_runs_without_the_figure_are_reported() -> None:
    """Runs with an infinite makespan on one side are excluded from means and differences, and reported."""
    rows = [row for run in range(4) for row in history("gappo", run, 1.0)]
    rows += [row for run, last in enumerate((1.2, 1.2, 1.2, math.inf)) for row in history("ppo", run, last)]
    rows += history("a2c", 0, math.inf)
    text, verdict = CLAIMS[0].find(Data(rows, []))
    assert text == "a2c no runs, 1 left out; ppo -0.200 [-0.200, -0.200], 3 runs, 1 left out"
    assert verdict == TOO_FEW
    table = next(line for line in page(rows, [], []).splitlines() if line.startswith("| `ppo` | 4 |"))
    assert "1.200 [1.200, 1.200], 1 left out" in table


def verdicts(ours: float, theirs: float, runs: int) -> list[str]:
    """Verdicts where `gappo` ends at one makespan and all rivals at another."""
    rows = []
    for run in range(runs):
        for method in PAPER_METHODS:
            makespan = (ours if method == "gappo" else theirs) + 0.001 * run * (method != "gappo")
            rows += history(method, run, 2.0, makespan, makespan)
    return [claim.find(Data(rows, []))[1] for claim in CLAIMS]


def test_verdicts_follow_the_rows() -> None:
    """The first claim holds if `gappo` leads in every run, fails if it is behind, and is left open otherwise."""
    assert verdicts(1.0, 1.1, runs=12)[0] == HOLDS
    assert verdicts(1.3, 1.1, runs=12)[0].startswith(NOT)
    assert verdicts(1.0, 1.1, runs=5)[0].startswith(UNKNOWN)


SOLVED = Solved("greedy", 0, 1, 1.0, "optimal", 1.0, 1.0, 0, 80.0, 0.1)


def described(ours: float, theirs: float, left: float, runs: int) -> list[str]:
    """Verdicts of `DESCRIBED` where `gappo` and its rivals end so in all scenarios; plans of rivals leave 80 %."""
    learned, solved = [], []
    for run in range(runs):
        for scenario in SCENARIOS:
            for name in PAPER_METHODS:
                rows = history(name, run, 2.0, ours, scenario=scenario)
                learned += [replace(row, battery=left if name == "gappo" else 55.0, distance=0.0) for row in rows]
            solved += [replace(SOLVED, method=name, run=run, scenario=scenario, makespan=theirs) for name in OTHERS]
    return [find(Data(learned, solved))[1] for find in DESCRIBED]


DESCRIBED = (traditional, least_energy, battery, optimal, sizes)


def test_descriptive_claims_need_eight_runs() -> None:
    """Means and medians decide with eight runs but not with seven; one run refutes a claim on every run."""
    assert described(1.0, 1.2, 90.0, runs=8) == [HOLDS] * 5
    assert described(1.0, 1.2, 90.0, runs=7) == [TOO_FEW] * 5
    assert described(1.2, 1.0, 50.0, runs=8) == [NOT, HOLDS, NOT, NOT, NOT]
    assert described(1.2, 1.0, 50.0, runs=7) == [TOO_FEW] * 3 + [NOT] * 2
    assert described(1.2, 1.0, 50.0, runs=0) == [TOO_FEW] * 5


def test_infinite_makespans_count_for_either_method() -> None:
    """A method that leaves tasks unserved has the worse median, and its energy is not compared."""
    assert described(1.0, math.inf, 90.0, runs=8)[:2] == [HOLDS, TOO_FEW]
    assert described(1.0, math.nan, 90.0, runs=8)[:2] == [HOLDS, TOO_FEW]
    assert described(math.inf, 1.0, 90.0, runs=8)[:2] == [NOT, TOO_FEW]


def test_proven_optima_are_derived_from_the_rows() -> None:
    """The page calls the bound the optimum only for instances with a plan of that makespan, and counts them."""
    learned = [*history("gappo", 0, 2.0, 1.2, scenario=1), *history("gappo", 0, 2.0, 1.2, scenario=2)]
    bounded = [replace(row, lower_bound=1.1) for row in learned]
    short = [replace(SOLVED, makespan=1.1, lower_bound=1.1)]
    assert "For 1 of 2 instances, a plan is known whose makespan equals the lower bound" in page(bounded, short, [])
    short += [replace(SOLVED, scenario=2, makespan=1.1, lower_bound=1.1)]
    assert "For all 2 instances, a plan is known whose makespan equals the lower bound" in page(bounded, short, [])
    assert proven(Data(bounded, short)) == (
        "2 of 2 instances have a plan whose makespan equals the proven bound, 1.1 h",
        UNKNOWN,
    )
    assert optimal(Data([replace(row, makespan=1.1) for row in bounded], []))[0].startswith("scenario 1: 1 of 1; ")


def test_makespans_are_in_hours_over_the_proven_bound() -> None:
    """Each game is compared with the bound of its own instance."""
    instances = [paper_like(8, 3, 24, 1), paper_like(8, 3, 30, 1)]
    judged = learning._judged(instances)
    assert judged.bound.tolist() == [makespan_lower_bound(instance) for instance in instances]
    need = judged.board.need[:, :-1].sum(1) / judged.board.ability.sum(1) * judged.bound
    totals = [float(instance.workload.sum() / instance.ability.sum()) for instance in instances]
    assert need.tolist() == pytest.approx(totals)


@pytest.mark.parametrize(
    ("rivals", "runs", "words"),
    [
        ({"ppo": 1.2}, 12, "The effect of the population was not measured"),
        ({"ppo": 1.2, "gappo-single": 1.0}, 12, "No effect of the population is shown** (no p"),
        ({"ppo": 1.0, "gappo-single": 1.2}, 9, "The population helps** (final T, best"),
        ({"ppo": 1.0, "gappo-single": 1.2}, 8, "No effect of the population is shown** (fewer than 9 runs"),
    ],
)
def test_population_is_compared_with_a_single_member(rivals: dict[str, float], runs: int, words: str) -> None:
    """A lead over PPO, which differs in more, is not attributed to the population, but mentioned."""
    rows = []
    for run in range(runs):
        for method, makespan in {"gappo": 1.0, **rivals}.items():
            last = makespan + 0.001 * run * (makespan > 1)
            rows += [replace(ROW, method=method, run=run, makespan=last, drawn=last)]
    text = page(rows, [], [])
    assert f"**{words}" in text
    assert "Against `ppo`, which differs in more than the population: final T" in text


@pytest.mark.parametrize(
    ("change", "runs", "verdict"),
    [(0.1, 12, "helps"), (-0.1, 12, "better without"), (0.0, 12, "no effect shown"), (0.1, 5, "too few runs")],
)
def test_component_is_compared_with_the_variant_without_it(change: float, runs: int, verdict: str) -> None:
    """Enough runs of a variant and the sign of the difference decide; without runs, it is not measured."""
    rows = [row for run in range(runs) for row in history("gappo", run, 1.2)]
    rows += [row for run in range(runs) for row in history("gappo-on-policy", run, 1.2 + change * (1 + 0.1 * run))]
    lines = page(rows, [], []).splitlines()
    (line,) = (line for line in lines if "`gappo-on-policy` |" in line)
    assert line.startswith("| replay |")
    assert line.endswith(f"**{verdict}** |")
    assert sum(line.endswith("**not measured** |") for line in lines) == len(ABLATIONS) - 1


def test_ablations_lack_one_component(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each variant learns, and differs from `gappo` only in the component that it is named after."""
    monkeypatch.setattr(learning, "DECISIONS", 4)
    whole = learning._untrained(VARIANTS["gappo"], 3)
    assert isinstance(whole, GeneticPpo)
    for name in ABLATIONS:
        variant = learning._untrained(VARIANTS[name], 3)
        assert isinstance(variant, GeneticPpo)
        changed = {
            field.name
            for field in fields(whole.population)
            if getattr(whole.population, field.name) != getattr(variant.population, field.name)
        }
        assert changed == LACKS[name]
        assert variant.policy.size.attention == (name != "gappo-no-attention")
        if name not in ("gappo-no-attention", "gappo-single"):
            pairs = zip(whole.policies(), variant.policies(), strict=True)
            assert all(weights(one).allclose(weights(other), atol=1e-6) for one, other in pairs)
        assert learning._trained(variant, Job(0, name), 5, (0, 0, 0.0))[0] >= 20


def weights(network: ActorCritic) -> torch.Tensor:
    return torch.cat([weight.detach().flatten() for weight in network.parameters()])


LACKS: dict[str, set[str]] = {
    "gappo-unshared": set(),
    "gappo-single": {"genes"},
    "gappo-no-evolution": {"breeding_interval"},
    "gappo-linear-rate": {"target_kl"},
    "gappo-no-attention": set(),
    "gappo-on-policy": {"buffer_size"},
}
"""Hyperparameters in which each differs."""


@pytest.mark.slow
def test_every_method_produces_its_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A short run of each method is evaluated at each point; a training is repeated to the same rows."""
    small = learning._judged([paper_like(8, 3, 24, 1)])
    monkeypatch.setattr(learning, "DECISIONS", 10)
    monkeypatch.setattr(learning, "_judged_by", lambda run: {TESTS: small, 4: small})
    monkeypatch.setattr(others, "scenarios_of", lambda run: (1,))
    monkeypatch.setattr(
        module, "expected", lambda job: {(TESTS, 0), (4, 0), (TESTS, 5), (4, 5)} if job.learns else {(1, 0)}
    )
    jobs = [Job(0, method, iterations=5, time_limit_s=0.05) for method in (*PAPER_METHODS, *OTHERS)]
    place = Folder(tmp_path)
    place.make(jobs, SerialEngine())
    assert place.missing(jobs) == []
    judged = [(row.scenario, row.iteration) for row in place.learned if row.method == "dqn"]
    assert judged == [(TESTS, 0), (4, 0), (TESTS, 5), (4, 5)]
    assert [math.isfinite(row.drawn) for row in place.learned[:4]] == [False, False, True, False]
    assert {row.makespan >= row.lower_bound == 1 for row in place.solved} == {True}
    again = Folder(tmp_path / "again")
    again.make(jobs[:1], SerialEngine())
    ours = [replace(row, seconds=0.0) for row in place.learned if row.method == "gappo"]
    assert str([replace(row, seconds=0.0) for row in again.learned]) == str(ours)
