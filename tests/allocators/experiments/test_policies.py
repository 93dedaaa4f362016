"""Comparison of policies on missions: rows, and paired differences with intervals."""

import threading
import time

import numpy as np
import pytest

from alloc.allocators import (
    AgentDecider,
    Briefing,
    Policy,
    PolicyInfo,
    compare_policies,
    load_policy,
    paired_differences,
    simulate,
)
from alloc.allocators.experiments import policies
from alloc.allocators.experiments.statistics import differences, interval
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.problems import InputError, MissionParameters, random_mission

MISSIONS = [random_mission(MissionParameters(agents=3, tasks=4), seed) for seed in (1, 2, 3)]


class Faulty(Policy):
    """Fails before its first order."""

    info = PolicyInfo(name="faulty", summary="")

    def begin(self, briefing: Briefing):
        raise ZeroDivisionError("nine")


class Slow(Policy):
    """Takes two seconds for a decision."""

    info = PolicyInfo(name="slow", summary="")

    def begin(self, briefing: Briefing):
        return SlowDecider()


class SlowDecider(AgentDecider):
    def decide(self, view):
        time.sleep(2)


def test_row_has_means_over_the_seeds():
    """The figures of a row are the means, and the worst, of single runs with the same seeds."""
    (row,) = compare_policies(MISSIONS[:1], ["random"], [0, 1, 2])
    runs = [simulate(MISSIONS[0], "random", seed=seed).result for seed in (0, 1, 2)]
    times = [run.mission_time for run in runs]
    assert len(set(times)) > 1
    assert (row.runs, row.statuses, row.tasks_done_share) == (3, "done", 1.0)
    assert (row.mission_time_mean, row.mission_time_worst) == (pytest.approx(np.mean(times)), max(times))
    assert row.energy_mean == pytest.approx(np.mean([run.energy for run in runs]))
    assert row.switches_mean == pytest.approx(np.mean([run.switches for run in runs]))


def test_no_mean_mission_time_with_undone_tasks():
    """If a run does not do all tasks, there is no mean mission time; the share of tasks done still counts."""
    (row,) = compare_policies(MISSIONS[:1], ["idle"])
    assert (row.mission_time_mean, row.tasks_done_share, row.statuses) == (None, 0.0, "unfinished")


def test_refusals_and_failures_are_rows():
    """A policy that refuses a mission, or fails, has a row with the reason, and the others continue."""
    refused, failed, fine = compare_policies(MISSIONS[:1], ["replan", Faulty(), "nearest"], [4], knowledge="local")
    assert "needs full knowledge" in refused.reason
    assert failed.reason == "failed with seed 4: ZeroDivisionError: nine"
    assert (refused.runs, failed.runs, fine.runs, fine.knowledge) == (0, 0, 1, "local")


def test_policy_that_cannot_be_loaded_is_a_row(monkeypatch):
    """A plugin that cannot be constructed does not affect the results of others."""

    def load(name):
        raise ZeroDivisionError("nine")

    monkeypatch.setattr(policies, "load_policy", load)
    failed, fine = compare_policies(MISSIONS[:1], {"broken": "broken", "own": load_policy("nearest")})
    assert (failed.runs, failed.reason) == (0, "cannot be loaded: ZeroDivisionError: nine")
    assert fine.runs == 1


def test_differences_are_paired_by_mission_and_seed():
    """Over several missions a pair is a mission with the means over its seeds, over one a seed; with BCa intervals."""
    rows = list(compare_policies(MISSIONS, ["nearest", "random"], [0, 1]))
    (found,) = paired_differences(rows)
    ratios = np.array(
        [b.mission_time_mean / a.mission_time_mean - 1 for a, b in zip(rows[::2], rows[1::2], strict=True)]
    )
    assert (found.policy, found.against, found.mission_time.pairs) == ("random", "nearest", 3)
    assert found.mission_time.mean == pytest.approx(np.mean(ratios))
    assert (found.mission_time.low, found.mission_time.high) == pytest.approx(interval(ratios))
    (alone,) = paired_differences(rows[:2])
    assert (alone.mission_time.pairs, alone.priority_done_share.mean) == (2, 0.0)


def test_differences_match_the_report():
    """Mean, interval and number of pairs are those of `alloc report` on the same missions."""
    rows = list(compare_policies(MISSIONS, ["nearest", "random"], [0, 1]))
    (found,) = paired_differences(rows)
    endings = {
        name: [
            [Ending(outcome=Outcome.SOLVED, makespan=one.mission_time, energy=one.energy) for one in row.results]
            for row in rows
            if row.policy == name
        ]
        for name in ("nearest", "random")
    }
    for score, own in (("makespan", found.mission_time), ("energy", found.energy)):
        (theirs,) = differences(endings, score)
        assert (own.pairs, own.mean) == (theirs.instances, pytest.approx(theirs.mean))
        assert (own.low, own.high) == pytest.approx((theirs.low, theirs.high))


def test_pairs_without_a_value_are_left_out():
    """A policy that did not do all tasks has no pair of mission times, but one of shares."""
    (found,) = paired_differences(list(compare_policies(MISSIONS[:1], ["nearest", "idle"])))
    assert (found.mission_time.mean, found.mission_time.pairs) == (None, 0)
    assert (found.priority_done_share.mean, found.priority_done_share.low) == (-1.0, None)
    assert (found.energy.mean, found.energy.pairs) == (None, 0)  # idling takes none


def test_stop_event_ends_the_comparison():
    """Once the event is set, no further run starts, and complete rows have been yielded."""
    stop = threading.Event()
    rows = compare_policies(MISSIONS, ["idle", "nearest"], stop=stop)
    assert next(rows).policy == "idle"
    stop.set()
    assert list(rows) == []


def test_stop_event_ends_a_run_within_a_second():
    """A stop ends a run within a second though a decision takes longer, and the rows before it stay."""
    stop = threading.Event()
    rows = compare_policies(MISSIONS[:1], ["idle", Slow()], stop=stop)
    assert next(rows).policy == "idle"
    threading.Timer(0.2, stop.set).start()
    began = time.monotonic()
    assert list(rows) == []
    assert time.monotonic() - began < 1.2


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        ((MISSIONS, ["gredy"]), "policy"),
        ((MISSIONS, ["idle"], [-1]), "seeds"),
        ((MISSIONS, "idle"), "policies"),
        ((MISSIONS, [Faulty(), Faulty()]), "policies"),
    ],
)
def test_wrong_arguments_are_refused(arguments, place):
    """Invalid arguments are an error before the first run that names the parameter."""
    with pytest.raises(InputError) as caught:
        compare_policies(*arguments)
    assert caught.value.place == place
