"""alloc schema."""

import json
from importlib.resources import files

import pytest

from alloc.problems.formats.schemas import SCHEMAS, schema


@pytest.mark.parametrize("name", ["alloc-instance/1", "instance", "alloc-result/1", "result", "policy"])
def test_schema_is_printed_as_json(alloc, name):
    """The full name of a format, and the short one, print its schema to standard output and nothing else."""
    ran = alloc("schema", name)
    assert (ran.code, ran.err) == (0, "")
    assert ran.json == schema(name)


def test_formats_are_listed(alloc):
    """Without a name, all formats with a schema are listed on standard error."""
    ran = alloc("schema")
    assert (ran.code, ran.out) == (0, "")
    assert all(name in ran.err for name in SCHEMAS)


def test_unknown_formats_are_errors(alloc):
    """An unknown name gives one line with the most similar one, and exit code 2."""
    ran = alloc("schema", "alloc-instanze/1")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == "alloc: NAME: there is no format 'alloc-instanze/1' (did you mean 'alloc-instance/1'?)\n"


def test_metadata_of_policies_are_valid():
    """The metadata of every policy that ships with the package are valid."""
    from jsonschema import Draft202012Validator

    policies = files("alloc.allocators.learned.files") / "policies"
    shipped = sorted(path.name for path in policies.iterdir() if path.name.endswith(".safetensors"))
    assert shipped
    for file in (policies / name for name in shipped):
        with file.open("rb") as stream:
            metadata = json.loads(stream.read(int.from_bytes(stream.read(8), "little")))["__metadata__"]
        validator = Draft202012Validator(schema(metadata["format"]))
        assert list(validator.iter_errors(metadata)) == []
