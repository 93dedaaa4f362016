"""Each error in a JSON instance is one line with source, place and correction."""

import io
import json
import sys
from pathlib import Path
from typing import Any

import pytest

from alloc.problems import InputError
from alloc.problems.formats import from_document

from .conftest import the_error

AGENT = {"id": "a1", "ability": 4}
TASK = {"id": "t1", "workload": 20}
VALID: dict[str, Any] = {"format": "alloc-instance/1", "agents": [AGENT], "tasks": [TASK]}


JSON_TEXTS = {
    "empty": ("", "", "is empty"),
    "blank": (" \n\t", "", "is empty"),
    "cut off": ('{"format": "alloc-instance/1",\n "agents": [{"id": "a1"', "line 2 column 24", "is it cut off?"),
    "half a string": ('{"format": "allo', "line 1 column 12", "unterminated string"),
    "no JSON": ("id,ability\na1,4\n", "line 1 column 1", "is not JSON"),
    "two documents": ("{}\n{}", "line 2 column 1", "extra data"),
    "trailing comma": ('{"format": 1,}', "line 1 column 14", "is not JSON"),
    "5000 lists": ("[" * 5000 + "]" * 5000, "", "nested too deeply"),
    "5000 objects": ('{"a":' * 5000 + "1" + "}" * 5000, "", "nested too deeply"),
    "unclosed lists": ("[" * 100_000, "", "nested too deeply"),
    "list": ("[]", "", "must be a JSON object, got a list"),
    "number": ("12", "", "must be a JSON object, got 12"),
    "string": ('"x\\ny"', "", r"must be a JSON object, got 'x\ny'"),
    "no format": ("{}", "format", 'add "format": "alloc-instance/1"'),
    "same key twice": ('{"format": "a", "tau": 1, "tau": 2}', "", "'tau' occurs twice"),
    "same key twice in an agent": (
        '{"format": "alloc-instance/1", "agents": [{"id": "a"}, {"id": "b", "id": "c"}], "tasks": []}',
        "agents[1]",
        "'id' occurs twice",
    ),
    "NaN": (
        '{"format": "alloc-instance/1", "agents": [{"id": "a", "ability": NaN}],'
        ' "tasks": [{"id": "t", "workload": 1}]}',
        "agents[0].ability",
        "got NaN",
    ),
    "too large a number": (
        '{"format": "alloc-instance/1", "agents": [{"id": "a", "ability": 1, "range": 1e999}],'
        ' "tasks": [{"id": "t", "workload": 1}]}',
        "agents[0].range",
        "must be a finite number, or null for no limit, got Infinity",
    ),
    "too many digits": (
        f'{{"format": "alloc-instance/1", "agents": [{{"id": "a", "ability": 1}}],'
        f' "tasks": [{{"id": "t", "workload": {"9" * 5000}}}]}}',
        "tasks[0].workload",
        "must be a finite number >= 0",
    ),
}


@pytest.mark.parametrize("case", JSON_TEXTS)
def test_texts_that_are_not_an_instance_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    """Text that is not the right JSON is located, in a file and on standard input alike."""
    text, place, words = JSON_TEXTS[case]
    (tmp_path / "x.json").write_text(text)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    for path in (tmp_path / "x.json", "-"):
        error = the_error(path)
        assert (error.place, words in error.message) == (place, True), str(error)


def changed(**fields: Any) -> dict[str, Any]:
    return {**VALID, **fields}


def agent(**fields: Any) -> dict[str, Any]:
    return changed(agents=[AGENT, {"id": "a2", "ability": 1, **fields}])


def task(**fields: Any) -> dict[str, Any]:
    return changed(tasks=[TASK, {"id": "t2", "workload": 1, **fields}])


def distances(*rows: Any, **fields: Any) -> dict[str, Any]:
    agents = [AGENT, {"id": "a2", "ability": 1}, {"id": "both", "ability": 1}]
    return changed(
        agents=agents,
        tasks=[TASK, {"id": "both", "workload": 1}],
        distances={"rows": [["a1", "t1", 2], *rows], **fields},
    )


def units(**labels: Any) -> dict[str, Any]:
    return changed(units=labels)


DOCUMENTS = [
    (changed(format="alloc-instance/2"), "format", "must be 'alloc-instance/1', got 'alloc-instance/2'"),
    (changed(format="alloc-result/1"), "format", "must be 'alloc-instance/1', got 'alloc-result/1'"),
    (
        changed(format="alloc-mission/1"),
        "format",
        "must be 'alloc-instance/1', got 'alloc-mission/1'; `alloc simulate` and",
    ),
    (changed(format=1), "format", "got 1"),
    (changed(format=["alloc-instance/1"]), "format", "got a list"),
    (changed(format={}), "format", "got an object"),
    (changed(agent=[]), "", "unknown field 'agent' (did you mean 'agents'?)"),
    (changed(**{"": 1}), "", "unknown field ''"),
    (changed(**{"x\n" * 5000: 1}), "", r"unknown field 'x\nx\n"),
    (changed(name=5), "name", "must be a string, got 5"),
    (changed(name="a\0b"), "name", "without NUL"),
    (changed(name="\ud800"), "name", "must be valid Unicode"),
    (changed(tau=1), "tau", "must lie strictly between 0 and 1, got 1"),
    (changed(tau="0.5"), "tau", "must be a number, got '0.5'"),
    (changed(tau=True), "tau", "must be a number, got true"),
    (changed(energy_per_distance=-1), "energy_per_distance", "must be a finite number >= 0"),
    (changed(energy_per_distance=[]), "energy_per_distance", "must be a number, got a list"),
    (changed(agents=None), "agents", "is missing"),
    (changed(agents=[]), "agents", "at least one agent and one task"),
    (changed(tasks=[]), "tasks", "at least one agent and one task"),
    (changed(agents={}), "agents", "must be a list, got an object"),
    (changed(agents="a1"), "agents", "must be a list, got 'a1'"),
    (changed(tasks=3), "tasks", "must be a list, got 3"),
    (changed(agents=[AGENT, None]), "agents[1]", "must be a JSON object, got null"),
    (changed(agents=[AGENT, [1]]), "agents[1]", "must be a JSON object, got a list"),
    (changed(tasks=[TASK, "t"]), "tasks[1]", "must be a JSON object, got 't'"),
    (changed(agents=[{"ability": 1}]), "agents[0].id", "must be a non-empty string, got null"),
    (changed(agents=[{"id": "a"}]), "agents[0].ability", "is missing; it must be a number > 0"),
    (changed(tasks=[{"id": "t"}]), "tasks[0].workload", "is missing; it must be a number >= 0"),
    (agent(id=7), "agents[1].id", "must be a non-empty string, got 7"),
    (agent(id=""), "agents[1].id", "must be a non-empty string, got ''"),
    (agent(id="a1"), "agents[1].id", "'a1' is used twice"),
    (agent(id="\udfff"), "agents[1].id", "must be valid Unicode"),
    (agent(speeed=1), "agents[1]", "unknown field 'speeed' (did you mean 'speed'?)"),
    (agent(communication_range=1), "agents[1]", "unknown field 'communication_range'"),
    (agent(ability="4"), "agents[1].ability", "must be a number, got '4'"),
    (agent(ability=True), "agents[1].ability", "must be a number, got true"),
    (agent(ability=None), "agents[1].ability", "is missing"),
    (agent(ability=0), "agents[1].ability", "must be a finite number > 0, got 0"),
    (agent(ability=-2), "agents[1].ability", "must be a finite number > 0, got -2"),
    (agent(ability=float("inf")), "agents[1].ability", "must be a finite number > 0"),
    (agent(ability=10**400), "agents[1].ability", "must be a finite number > 0"),
    (agent(battery=-1), "agents[1].battery", "must be a number >= 0, or null, got -1"),
    (agent(range={}), "agents[1].range", "must be a number, got an object"),
    (agent(range=-0.5), "agents[1].range", "must be a number >= 0, or null, got -0.5"),
    (agent(speed=0), "agents[1].speed", "must be a number > 0, or null, got 0"),
    (agent(speed=float("inf")), "agents[1].speed", "must be a finite number, or null for no limit"),
    (agent(battery=float("nan")), "agents[1].battery", "must be a finite number, got NaN"),
    (agent(position=5), "agents[1].position", "must be a list of 2 or 3 numbers, or null, got 5"),
    (agent(position="12"), "agents[1].position", "must be a list of 2 or 3 numbers, or null, got '12'"),
    (agent(position=[1]), "agents[1].position", "must have 2 or 3 coordinates, got 1"),
    (agent(position=[1, 2, 3, 4]), "agents[1].position", "must have 2 or 3 coordinates, got 4"),
    (agent(position=[1, "2"]), "agents[1].position[1]", "must be a number, got '2'"),
    (agent(position=[None, None]), "agents[1].position[0]", "must be a number, got null"),
    (agent(position=[1, 2, False]), "agents[1].position[2]", "must be a number, got false"),
    (agent(position=[1, float("nan")]), "agents[1].position", "must be finite numbers, got NaN"),
    (agent(position=[1, 10**400]), "agents[1].position", "must be finite numbers, got Infinity"),
    (agent(start_task="t9"), "agents[1].start_task", "there is no task 't9' (known: t1)"),
    (agent(start_task=0), "agents[1].start_task", "must be the id of a task, or null, got 0"),
    (agent(start_task=""), "agents[1].start_task", "there is no task ''"),
    (agent(tasks="t1"), "agents[1].tasks", "must be a list of task ids, or null, got 't1'"),
    (agent(tasks=["t1", 1]), "agents[1].tasks[1]", "must be the id of a task, got 1"),
    (agent(tasks=["t1", None]), "agents[1].tasks[1]", "must be the id of a task, got null"),
    (agent(tasks=["t1", "t7\n" * 9999]), "agents[1].tasks", r"there is no task 't7\nt7"),
    (task(workload=-1), "tasks[1].workload", "must be a finite number >= 0, got -1"),
    (task(priority=-1), "tasks[1].priority", "must be a finite number >= 0, got -1"),
    (task(ability=1), "tasks[1]", "unknown field 'ability'"),
    (task(id="t1"), "tasks[1].id", "'t1' is used twice"),
    (task(needs="camera"), "tasks[1].needs", "must be a list of strings, or null, got 'camera'"),
    (task(skills=[]), "tasks[1]", "unknown field 'skills'"),
    (agent(skills=[1]), "agents[1].skills[0]", "must be a string, got 1"),
    (agent(skills=["camera", ""]), "agents[1].skills", "must be non-empty strings"),
    (agent(skills=["a\0"]), "agents[1].skills", "without NUL"),
    (agent(needs=[]), "agents[1]", "unknown field 'needs'"),
    (agent(returns="yes"), "agents[1].returns", "there is no base 'yes'; say true, false or the id"),
    (agent(returns=1), "agents[1].returns", "must be true, false or the id of a base, got 1"),
    (agent(energy_per_distance=-1), "agents[1].energy_per_distance", "must be a finite number >= 0, got -1"),
    (agent(energy_per_distance=1e61), "agents[1].energy_per_distance", "must be from 1e-60 to 1e+60"),
    (agent(energy_per_distance="1"), "agents[1].energy_per_distance", "must be a number, got '1'"),
    (changed(metric="geodesic"), "metric", "must be one of euclidean, manhattan, geographic, got 'geodesic'"),
    (changed(metric=1), "metric", "must be a string, got 1"),
    (changed(units="km"), "units", "must be a JSON object, got 'km'"),
    (units(length="km"), "units", "unknown field 'length'"),
    (units(time=1), "units.time", "must be a string, got 1"),
    (units(work="x" * 21), "units.work", "must be a text of at most 20 characters"),
    (
        units(speed="m"),
        "units.speed",
        "must be one of m, km, mi, nmi, ft per one of s, min, h, d, such as 'm/s', or 'kn'",
    ),
    (units(speed="furlong/h", time="h", distance="km"), "units.speed", "got 'furlong/h'"),
    (units(speed="m/s", time="h"), "units.distance", "is missing; it is needed to convert speeds in m/s"),
    (units(speed="m/s", distance="km"), "units.time", "is missing; it is needed to convert speeds in m/s"),
    (
        units(speed="kn", time="hours", distance="km"),
        "units.time",
        "must be one of s, min, h, d to convert speeds in kn",
    ),
    (changed(metric="geographic", units={"distance": "ft"}), "units.distance", "must be one of m, km, mi, nmi"),
    (agent(position=[0, 91]) | {"metric": "geographic"}, "agents[1].position", "must be longitude (-180 to 360)"),
    (changed(distances=[]), "distances", "must be a JSON object, got a list"),
    (changed(distances={}), "distances.rows", "must be a list of [from, to, distance], got null"),
    (changed(distances={"rows": {}}), "distances.rows", "must be a list of [from, to, distance], got an object"),
    (distances(row=1), "distances", "unknown field 'row' (did you mean 'rows'?)"),
    (distances(missing="none"), "distances.missing", "must be 'metric' or 'unreachable', got 'none'"),
    (distances(missing=1), "distances.missing", "must be a string, got 1"),
    (distances(["a2", "t1"]), "distances.rows[1]", "must be [from, to, distance], got a list"),
    (distances("a2 t1 3"), "distances.rows[1]", "must be [from, to, distance], got 'a2 t1 3'"),
    (distances([1, "t1", 3]), "distances.rows[1][0]", "must be the id of an agent or a task, got 1"),
    (distances(["a2", None, 3]), "distances.rows[1][1]", "must be the id of an agent or a task, got null"),
    (distances(["a2", "t1", "3"]), "distances.rows[1][2]", "must be a number, got '3'"),
    (distances(["a2", "t1", None]), "distances.rows[1][2]", "must be a number, got null"),
    (distances(["a2", "t1", True]), "distances.rows[1][2]", "must be a number, got true"),
    (distances(["a2", "t1", -1]), "distances.rows[1]", "must have a distance that is a finite number >= 0"),
    (distances(["a2", "t1", 10**400]), "distances.rows[1]", "must have a distance that is a finite number >= 0"),
    (distances(["a2", "t2", 1]), "distances.rows[1][1]", "there is no agent or task 't2' (known: a1, a2"),
    (distances(["both", "t1", 1]), "distances.rows[1][0]", "'both' is the id of an agent and of a task"),
    (distances(["a1", "a2", 1]), "distances.rows[1]", "joins two agents"),
    (distances(["t1", "a1", 1], ["a1", "t1", 3]), "distances.rows[2]", "gives a pair that an earlier row gives"),
]


@pytest.mark.parametrize(("document", "place", "words"), DOCUMENTS)
def test_invalid_documents_are_located(tmp_path: Path, document: dict[str, Any], place: str, words: str) -> None:
    """Each rule of the format is checked, with the place of violations, for files and plain objects."""
    with pytest.raises(InputError):
        from_document(document)
    (tmp_path / "x.json").write_text(json.dumps(document))
    error = the_error(tmp_path / "x.json")
    assert error.place == place, str(error)
    assert words in error.message


def test_overflowing_magnitudes_are_refused(tmp_path: Path) -> None:
    """Finite abilities beyond the limits are refused with the limits."""
    document = changed(agents=[{"id": name, "ability": 1.7e308} for name in "ab"])
    (tmp_path / "x.json").write_text(json.dumps(document))
    assert "must be from 1e-60 to 1e+60" in the_error(tmp_path / "x.json").message
