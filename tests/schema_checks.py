"""Validation of documents by the schemas of their formats; what a schema does not describe is an error, too."""

import json
from functools import cache
from typing import Any

from jsonschema import Draft202012Validator

from alloc.problems.formats.schemas import SCHEMAS, schema

LARGEST = 300
"""Agents, tasks or rows beyond which a document is not checked: it would take seconds."""


def closed(part: Any) -> Any:
    """Return a schema by which the objects that it describes have no other fields."""
    if isinstance(part, list):
        return [closed(entry) for entry in part]
    if not isinstance(part, dict):
        return part
    inner = {key: value if key == "allOf" else closed(value) for key, value in part.items()}
    if part.get("type") == "object" and "properties" in part:
        return {"additionalProperties": False, **inner}
    return inner


@cache
def validator(name: str, *, strict: bool = True) -> Draft202012Validator:
    """Return what checks documents of a format; `strict`: fields that the schema does not name are faults."""
    found = schema(name)
    return Draft202012Validator(closed(found) if strict else found)


def faults(document: dict[str, Any], *, strict: bool = True) -> list[str]:
    """Return what is wrong with a document by the schema of its format."""
    name = str(document["format"])
    if name == "alloc-instance/1" and "agents" not in document:  # instance.json of a folder of tables
        rows = {"agents": [{"id": "a", "ability": 1}], "tasks": [{"id": "t", "workload": 1}]}
        document = document | rows
        if document.get("distances"):
            document["distances"] = document["distances"] | {"rows": []}
    found = validator(name, strict=strict).iter_errors(json.loads(json.dumps(document)))
    return [f"{error.json_path}: {error.message}" for error in found]


def require_valid(value: object) -> None:
    """Fail if this is a document that is not as the schema of its format says, unless it is very large."""
    if not isinstance(value, dict) or not str(value.get("format")).startswith("alloc-"):
        return
    if all(len(part) <= LARGEST for part in value.values() if isinstance(part, list | dict)):
        assert value["format"] in SCHEMAS
        assert faults(value) == []
