"""Reading, writing and errors of alloc-mission/1 and alloc-mission-log/1."""

import copy
import json

import pytest
from drawn_missions import missions, random_mission_of_any_kind, run_wildly
from hypothesis import given, settings
from schema_checks import faults

from alloc.problems import InputError, Mission, read_log, read_mission, replay, write_log, write_mission
from alloc.problems.formats import to_document
from alloc.problems.missions.files.document import mission_from_document, mission_to_document
from alloc.problems.missions.replay import log_of
from alloc.problems.missions.simulation.measures import DecisionTimes, measured

DEMO = {
    "format": "alloc-mission/1", "name": "demo", "horizon": 24.0, "knowledge": "local", "sensing": 0.3,
    "radio": {"radius": 0.3, "period": 0.1, "loss": 0.2, "delay": 0.0, "burst": None},
    "tau": 0.5, "energy_per_distance": 6.0, "metric": "euclidean", "pace": None, "seed": 7,
    "agents": [{"id": "a1", "ability": 4, "position": [0.1, 0.2], "speed": 0.5, "battery": 20, "joins": 0}],
    "tasks": [{"id": "t1", "workload": 20, "position": [0.5, 0.5], "priority": 1, "appears": 1.5, "deadline": 9.0,
               "growth": 0}],
    "events": [{"hour": 5.0, "event": "agent-fails", "agent": "a1"},
               {"hour": 3.0, "event": "task-changes", "task": "t1", "workload": 5.0},
               {"hour": 2.0, "event": "task-appears", "task": {"id": "t2", "workload": 3, "deadline": 8}},
               {"hour": 1.0, "event": "agent-joins", "agent": {"id": "a2", "ability": 3}}],
}  # fmt: skip


def test_example_is_read():
    """Agents and tasks defined in events are among the others, and the timeline is chronological."""
    mission = mission_from_document(DEMO)
    assert mission.instance.agent_ids == ("a1", "a2")
    assert mission.instance.task_ids == ("t1", "t2")
    assert mission.joins.tolist() == [0, 1]
    assert mission.appears.tolist() == [1.5, 2]
    assert mission.deadline.tolist() == [9, 8]
    assert [event.hour for event in mission.timeline] == [0, 1, 1.5, 2, 3, 5]
    assert faults(DEMO) == []


@given(missions())
@settings(max_examples=30, deadline=None)
def test_missions_survive_a_round_trip(mission):
    """A written mission is valid by the schema, and is read as an equal mission."""
    document = json.loads(json.dumps(mission_to_document(mission)))
    assert faults(document) == []
    assert mission_to_document(mission_from_document(document)) == mission_to_document(mission)


def test_instance_is_read_as_a_mission(tmp_path):
    """An instance file in any format is read as a mission with all agents and tasks from the start."""
    from alloc.problems import paper, write_instance

    for name in ("i.json", "i.npz", "folder"):
        write_instance(paper(1, 0), tmp_path / name)
        mission = read_mission(tmp_path / name)
        assert to_document(mission.instance) == to_document(paper(1, 0))
        assert not mission.events
        assert (mission.joins == 0).all()


WRONG = [
    ("agents", 0, "joins", -1, "agents[0].joins: must be a finite number >= 0"),
    ("agents", 0, "joins", "x", "agents[0].joins: must be a number"),
    ("agents", 0, "speeed", 1, "agents[0]: unknown field 'speeed' (did you mean 'speed'?)"),
    ("tasks", 0, "deadline", 1, "tasks[0].deadline: must be after the hour at which the task appears"),
    ("tasks", 0, "growth", -2, "tasks[0].growth: must be a finite number >= 0"),
    ("tasks", 0, "appears", None, "events[1]: "),
    ("events", 0, "agent", "a9", "events[0].agent: there is no agent 'a9'"),
    ("events", 0, "event", "agent-flies", "events[0].event: is 'agent-flies', but must be one of"),
    ("events", 0, "hour", None, "events[0].hour: is missing"),
    ("events", 0, "hour", -1, "events[0].hour: must be a finite number >= 0"),
    ("events", 0, "workload", 4, "events[0]: unknown field 'workload'"),
    ("events", 1, "workload", None, "events[1].workload: is missing"),
    ("events", 1, "hour", 0.5, "events[1]: task-changes at hour 0.5 needs task 't1' to be there, but it is to come"),
    ("events", 2, "task", {"id": "t2", "workload": -3}, "events[2].task.workload: must be a finite number >= 0"),
    ("events", 2, "task", {"id": "t1", "workload": 3}, "events[2].task.id: the id 't1' is used twice"),
    ("events", 3, "agent", "a1", "agents[0].joins: is hour 0, but an event says 1"),
    (None, None, "knowledge", "some", "knowledge: must be one of full, local"),
    (None, None, "horizon", 0, "horizon: must be a finite number > 0"),
    (None, None, "sensing", -1, "sensing: must be a finite number >= 0"),
    (None, None, "seed", 1.5, "seed: must be a whole number >= 0"),
    (None, None, "events", {}, "events: must be a list"),
    (None, None, "radio", {"loss": 2}, "radio.loss: must be a finite number >= 0 and at most 1"),
    (None, None, "radio", {"period": 0}, "radio.period: must be"),
    (None, None, "radio", {"burst": {"good": 1}}, "radio.burst: needs bad"),
    (None, None, "radio", {"range": 2}, "radio: unknown field 'range'"),
    (None, None, "pace", {"low": 2, "high": 1}, "pace.high: must be at least pace.low"),
    (None, None, "horizn", 3, "unknown field 'horizn' (did you mean 'horizon'?)"),
]  # fmt: skip


@pytest.mark.parametrize(("part", "row", "field", "value", "told"), WRONG)
def test_faults_are_one_line_errors(part, row, field, value, told):
    """The error for a wrong field names its place and the expected value."""
    document = copy.deepcopy(DEMO)
    (document if part is None else document[part][row])[field] = value
    if told == "events[1]: ":
        document["events"][1]["hour"], document["tasks"][0]["appears"], told = 3.0, 4.0, "events[1]: task-changes"
    with pytest.raises(InputError) as caught:
        mission_from_document(document)
    assert str(caught.value).startswith(told)
    assert "\n" not in str(caught.value)


def test_sequences_of_events_must_be_possible():
    """An agent cannot return without a recall, fail twice, or join twice."""
    for events, told in (
        ([{"hour": 1, "event": "agent-returns", "agent": "a1"}], "needs agent 'a1' to be away"),
        ([{"hour": hour, "event": "agent-fails", "agent": "a1"} for hour in (1, 2)], "but it is failed"),
        ([{"hour": 1, "event": "radio-silent", "until": 2}], "a silence needs an agent, or a center and a radius"),
        ([{"hour": 1, "event": "radio-silent", "agent": "a1", "until": 0}], "before the silence begins"),
    ):
        with pytest.raises(InputError, match=told):
            mission_from_document(DEMO | {"events": events})


def test_returns_with_given_distances_are_refused():
    """Agents that return are refused with own distances: an agent stopped on the way has no distance home."""
    document = DEMO | {"distances": {"rows": [["a1", "t1", 2]]}, "agents": [DEMO["agents"][0] | {"returns": True}]}
    with pytest.raises(InputError, match=r"agents\[0\]\.returns: cannot be combined"):
        mission_from_document(document)


def logged(seed):
    """Return the log of a random mission under random orders."""
    import numpy as np

    simulation = run_wildly(random_mission_of_any_kind(np.random.default_rng(seed)), seed)
    return log_of(simulation, measured(simulation, "wild", seed, DecisionTimes()))


@pytest.mark.parametrize("seed", range(6))
def test_log_is_replayed_byte_for_byte(seed, tmp_path):
    """The file alone reproduces the same lines and the same figures, and the conservation laws hold."""
    log = logged(seed)
    write_log(log, tmp_path / "log.jsonl")
    read = read_log(tmp_path / "log.jsonl")
    assert read.to_text() == log.to_text()
    result, laws = replay(read)
    assert json.dumps(result.to_dict()) == json.dumps(log.result)
    total = laws.work_done + laws.work_left + laws.work_cancelled + laws.work_missed
    assert laws.work_appeared == pytest.approx(total, rel=1e-9)
    assert laws.battery_lost == pytest.approx(laws.battery_energy, rel=1e-9, abs=1e-9)


def test_changed_log_is_an_error_at_its_line(tmp_path):
    """A changed hour, a changed order, a missing line and a changed figure are each an error."""
    lines = logged(2).to_text().splitlines()
    order = next(number for number, line in enumerate(lines) if '"record": "arrival"' in line)
    broken = {
        "hour": [*lines[:order], lines[order].replace('"hour": ', '"hour": 1'), *lines[order + 1 :]],
        "short": [*lines[:order], *lines[order + 1 :]],
        "figure": [*lines[:-1], lines[-1].replace('"switches": ', '"switches": 1')],
        "cut off": lines[:-1],
        "no JSON": [*lines[:3], "{", *lines[3:]],
    }
    for name, changed in broken.items():
        (tmp_path / "log.jsonl").write_text("\n".join(changed) + "\n")
        with pytest.raises(InputError, match=r"line \d+"):
            replay(read_log(tmp_path / "log.jsonl"))
        assert name


def test_missions_are_written_only_as_json(tmp_path):
    """A file name with another suffix is refused."""
    with pytest.raises(InputError, match=r"use \.json"):
        write_mission(mission_from_document(DEMO), tmp_path / "mission.csv")
    write_mission(mission_from_document(DEMO), tmp_path / "mission.json")
    assert isinstance(read_mission(tmp_path / "mission.json"), Mission)
