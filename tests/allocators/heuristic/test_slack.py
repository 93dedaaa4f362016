"""The note on what 0.1 % more time would save appears only if it saves something."""

import re

import numpy as np
import pytest

from alloc.allocators import solve
from alloc.allocators.heuristic import slack
from alloc.allocators.heuristic.local_search.improve import improve
from alloc.problems import Instance

RNG = np.random.default_rng(1)
PLACES = {"agent_position": RNG.random((60, 2)), "task_position": RNG.random((12, 2))}
REAL = Instance(ability=RNG.uniform(1, 10, 60), workload=RNG.uniform(10, 80, 12), **PLACES)
WHOLE = Instance(ability=RNG.integers(1, 10, 60), workload=RNG.integers(10, 80, 12), **PLACES)
SETTINGS = {"method": "local-search", "iterations": 60, "time_limit_s": None}


def notes_on_slack(result):
    return [note for note in result.notes if "more time would save" in note]


def test_noted_saving_is_reached_with_slack():
    """At the least makespan of real abilities energy is high, and a run with slack saves what the note says."""
    result = solve(REAL, objective="makespan-energy", **SETTINGS)
    (note,) = notes_on_slack(result)
    saving, energy, makespan = re.fullmatch(
        r"0.1 % more time would save ([\d.]+) % of the energy: a plan was found that takes ([\d.]+) and ([\d.]+) "
        r"\(--makespan-slack 0.001\)",
        note,
    ).groups()
    assert result.makespan < float(makespan) <= 1.001 * result.makespan * (1 + 1e-5)
    assert float(energy) <= result.energy * (1 - float(saving) / 100 + 0.01)
    slow = solve(REAL, objective="makespan-energy", makespan_slack=0.001, **SETTINGS)
    assert slow.energy < 0.99 * result.energy


@pytest.mark.parametrize(
    ("instance", "settings"),
    [
        (WHOLE, {"objective": "makespan-energy"}),
        (REAL, {"objective": "makespan"}),
        (REAL, {"objective": "makespan-energy", "makespan_slack": 0.001}),
        (REAL, {"objective": "makespan-energy", "method": "greedy"}),
    ],
)
def test_note_on_slack_appears_only_where_useful(instance, settings):
    """Integer abilities, the makespan objective, runs with slack, and methods without search have no such note."""
    assert notes_on_slack(solve(instance, **{**SETTINGS, **settings})) == []


@pytest.mark.parametrize("limit", [None, 60])
def test_small_instances_are_searched_briefly(limit, monkeypatch):
    """Each search makes at most one iteration per agent, however much time there is."""
    made = []

    def counted(part):
        improve(part)
        made.append(part.iteration)

    monkeypatch.setattr(slack, "improve", counted)
    instance = Instance(
        ability=RNG.uniform(1, 10, 5), workload=[3, 4], task_position=[[0, 0], [1, 1]], start_task=[0] * 5
    )
    solve(instance, "cpsat", objective="makespan-energy", time_limit_s=limit)
    assert made == [5, 5]
