"""The schemas agree with readers and writers, as far as schemas can express their rules."""

import copy
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from schema_checks import faults

import alloc.problems
from alloc.allocators import pareto, solve
from alloc.problems import InputError, Instance, read_instance
from alloc.problems.formats import from_document, to_document
from alloc.problems.formats.schemas import SCHEMAS, schema

from .test_malformed_json import DOCUMENTS

ROOT = Path(__file__).parents[3]
TEXTS = {path: path.read_text("utf-8") for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]}
EXAMPLES = sorted((ROOT / "examples").rglob("*.json"))

BEYOND = ("used twice", "there is no", "Unicode", "in smaller units", "must be finite", "id of an agent and of a task")
BEYOND += ("id of two of the", "joins two agents", "that an earlier row gives", "a finite number", "for no limit")
"""What schemas cannot say: that ids are unique and lead somewhere, that numbers of Python are numbers of JSON."""


@pytest.mark.parametrize("name", SCHEMAS)
def test_schemas_are_valid(name: str) -> None:
    """Each is valid by the draft that it declares, and describes the format of its name."""
    found = schema(name)
    assert found["$schema"] == Draft202012Validator.META_SCHEMA["$id"]
    Draft202012Validator.check_schema(found)
    assert found["properties"]["format"] == {"const": name}
    assert schema(name.removeprefix("alloc-").removesuffix("/1")) == found


def test_every_format_has_a_schema() -> None:
    """Each format named in the code and the documents has one, except checkpoints, which are not JSON."""
    package = Path(alloc.problems.__file__).parents[1]  # of the working tree, or as installed
    sources = [path for part in ("problems", "allocators", "cli") for path in (package / part).glob("**/*.py")]
    texts = [*TEXTS.values(), *(path.read_text("utf-8") for path in sources)]
    named = {name for text in texts for name in re.findall(r"\balloc-[a-z-]+/\d+\b", text)}
    assert named - {"alloc-checkpoint/3"} == set(SCHEMAS)


def shown(text: str) -> list[Any]:
    """Return the documents that a text shows in indented blocks, or in fences."""
    blocks = re.findall(r"^ {4}(\{\"format\": \"alloc-(?:.*\n)(?: {4}.*\n)*)", text, re.MULTILINE)
    blocks += re.findall(r"^```json\n(\{\"format\": \"alloc-.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [json.loads(block) for block in blocks]


def test_documented_examples_are_valid() -> None:
    """Every example of a format in the documents, and every file of the examples, is valid by its schema."""
    documents = [document for text in TEXTS.values() for document in shown(text)]
    assert {document["format"] for document in documents} >= {f"alloc-{name}/1" for name in ("instance", "result")}
    assert len(documents) >= 5
    documents += [json.loads(path.read_text("utf-8")) for path in EXAMPLES]
    assert [found for document in documents if (found := faults(document))] == []


@pytest.mark.parametrize(
    "document", [document for document, _, words in DOCUMENTS if not any(word in words for word in BEYOND)]
)
def test_documents_refused_by_the_reader_are_invalid(document: dict[str, Any]) -> None:
    """Documents refused by the reader are invalid by the schema, except for rules that schemas cannot express."""
    assert list(Draft202012Validator(schema("alloc-instance/1")).iter_errors(document)) != []


WRONG = (None, True, "", "x", "t1", -1, 0, 1.5, 200, 1e70, [], [1], ["x"], [1, 2, 3], {}, {"x": 1})


def changes(part: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of every value within a document."""
    for key, value in part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ():
        yield (*path, key)
        yield from changes(value, (*path, key))


def changed(document: dict[str, Any], path: tuple[Any, ...], value: Any) -> dict[str, Any]:
    """Return a document with another value at a path."""
    result = copy.deepcopy(document)
    part: Any = result
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = value
    return result


def refusal(document: dict[str, Any]) -> str:
    """Return why the reader refuses a document, nothing where it takes it."""
    try:
        from_document(document)
    except InputError as error:
        return str(error)
    return ""


def test_reader_and_schema_agree(varied: Instance) -> None:
    """Reader and schema agree on any changed value of an instance, except for rules that schemas cannot express."""
    document: dict[str, Any] = json.loads(json.dumps(to_document(varied)))
    document["units"]["speed"] = "kn"
    validator = Draft202012Validator(schema("alloc-instance/1"))
    counts = {True: 0, False: 0}
    for path in changes(document):
        for value in WRONG:
            other = changed(document, path, value)
            refused, is_valid = refusal(other), validator.is_valid(other)
            counts[is_valid] += 1
            if not refused:
                assert is_valid, (path, value)
            elif is_valid:
                assert any(word in refused for word in BEYOND), (path, value, refused)
    assert min(counts.values()) > 100


def test_missing_and_unknown_fields_of_instances_are_invalid(varied: Instance) -> None:
    """Omitting a required field, or adding an unknown one, is an error; other fields are optional."""
    document: dict[str, Any] = json.loads(json.dumps(to_document(varied)))
    validator = Draft202012Validator(schema("alloc-instance/1"))
    required = {("format",), ("agents",), ("tasks",), ("distances", "rows")}
    required |= {
        (kind, 0, name) for kind, own in (("agents", "ability"), ("tasks", "workload")) for name in ("id", own)
    }
    for part, prefix in (
        (document, ()),
        (document["units"], ("units",)),
        (document["distances"], ("distances",)),
        (document["agents"][0], ("agents", 0)),
        (document["tasks"][0], ("tasks", 0)),
    ):
        for name in list(part):
            value = part.pop(name)
            assert validator.is_valid(document) == ((*prefix, name) not in required), (prefix, name)
            part[name] = value
        part["nonsense"] = None
        assert not validator.is_valid(document)
        del part["nonsense"]


def test_results_and_fronts_with_missing_fields_are_invalid(small: Instance) -> None:
    """Written documents are valid, but not if a field is missing or has another type; additional fields are allowed."""
    result = solve(small, "greedy", time_limit_s=1)
    documents = [result.to_dict(), pareto(small, "local-search", points=2, iterations=10).to_dict()]
    for document in documents:
        assert faults(document) == []
        assert faults({**document, "more": 1}, strict=False) == []
        assert faults({**document, "more": 1}) != []
        for name in document:
            left = {key: value for key, value in document.items() if key != name}
            assert name == "format" or faults(left, strict=False) != [], name
            assert name == "format" or faults({**document, name: {"x": [1]}}, strict=False) != [], name


def test_unknown_formats_are_errors() -> None:
    """An unknown name is an error with the most similar name."""
    with pytest.raises(InputError, match=r"no format 'instances' \(did you mean 'alloc-instance/1'\?\)"):
        schema("instances")


def test_fleet_example_uses_every_field() -> None:
    """The geographic example fleet is read, with speeds in km per minute, and has all the later fields."""
    fleet = read_instance(ROOT / "examples" / "fleet" / "fleet.json")
    assert fleet.metric == "geographic"
    assert fleet.speed.tolist() == pytest.approx([1.08, 1.08, 1.08, 1.44, 1.44, 0.54])
    assert fleet.units.time == "min"
    assert fleet.distances is not None
    assert fleet.skills is not None
    assert fleet.needs is not None
    assert fleet.returns.sum() == 5
