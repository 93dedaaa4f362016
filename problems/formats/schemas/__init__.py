"""JSON Schemas (draft 2020-12) of the formats, one file each."""

import json
from importlib.resources import files

from alloc.problems.errors import InputError, nearest

SCHEMAS = {
    "alloc-instance/1": "an instance as JSON",
    "alloc-allocation/1": "the task of each agent",
    "alloc-result/1": "the result that `alloc solve` writes",
    "alloc-pareto/1": "the front that `alloc pareto` writes",
    "alloc-whatif/1": "the fleets that `alloc whatif` compares",
    "alloc-evaluation/1": "the scores that `alloc evaluate --json` prints",
    "alloc-comparison/1": "the rows that `alloc compare --json` prints",
    "alloc-policy/1": "the metadata of a policy file",
    "alloc-mission-policy/1": "the metadata of a policy file for missions",
    "alloc-mission/1": "a mission: an instance and events over time",
    "alloc-mission-result/1": "the measures that `alloc simulate --json` prints",
    "alloc-mission-comparison/1": "the rows that `alloc compare --policies --json` prints",
    "alloc-mission-log/1": "the first line of a log of `alloc simulate --log`",
    "alloc-planner-request/1": "the lines that `alloc plan --stdio` reads",
    "alloc-planner-orders/1": "the lines that `alloc plan --stdio` writes",
    "alloc-solve-request/1": "the requests that `alloc serve` accepts",
    "alloc-solve-answer/1": "the answers that `alloc serve` returns",
    "alloc-planner/1": "a planner, as `alloc plan --state` saves it",
}
"""Description of each format with a schema."""


def schema(name: str) -> dict[str, object]:
    """Return the JSON Schema of a format.

    Parameters
    ----------
    name : str
        Such as ``alloc-instance/1``, or ``instance`` for short.

    Raises
    ------
    InputError
        If there is no such format.
    """
    return dict(json.loads(schema_text(name)))


def schema_text(name: str) -> str:
    """Return the JSON Schema of a format as text; see `schema`."""
    full = next((one for one in SCHEMAS if name in (one, _short(one))), None)
    if full is None:
        raise InputError(f"there is no format {name!r}{nearest(name, tuple(SCHEMAS))}", "name")
    return files(__package__).joinpath(f"{full.replace('/', '-')}.json").read_text("utf-8")


def _short(name: str) -> str:
    return name.removeprefix("alloc-").partition("/")[0]
