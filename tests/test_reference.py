"""docs/reference/ matches the docstrings, and has a page for every public name."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from alloc import allocators, problems

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The script that makes the page, as a module."""
    spec = importlib.util.spec_from_file_location("make_reference", DOCS / "make_reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages(script: ModuleType) -> dict[str, str]:
    """What the script makes of the docstrings, by place in docs/reference/."""
    made: dict[str, str] = script.pages()
    return made


def test_pages_are_up_to_date(pages: dict[str, str]) -> None:
    """The pages equal those generated from the docstrings; `python docs/make_reference.py` regenerates them."""
    folder = DOCS / "reference"
    assert {path.relative_to(folder).as_posix(): path.read_text("utf-8") for path in folder.rglob("*.md")} == pages


def test_every_public_name_has_a_page(pages: dict[str, str]) -> None:
    """Every name in `__all__` has a page with content, and is listed once in the index with a summary."""
    index = pages["index.md"]
    entries = {path.rpartition("/")[2][:-3]: text for path, text in pages.items() if path != "index.md"}
    assert set(entries) == {*problems.__all__, *allocators.__all__}
    assert [name for name, text in entries.items() if len(text.split()) < 5] == []
    rows = re.findall(r"^\| \[`(\w+)`\]\(([\w/.]+)\) \| .+ \|$", index, re.MULTILINE)
    assert sorted(rows) == sorted((path.rpartition("/")[2][:-3], path) for path in pages if path != "index.md")


def test_page_names_differ_without_case(pages: dict[str, str]) -> None:
    """Page names differ on file systems that ignore case, such as those of macOS and Windows."""
    assert len({path.casefold() for path in pages}) == len(pages)


def test_sections_of_docstrings_become_lists(script: ModuleType) -> None:
    """Parameters are items with their types, exceptions with their reasons, and plain sections stay text."""
    parameters = "Parameters\n----------\nx, y : int\n    How often,\n    at most.\n"
    raises = "Raises\n------\nInputError\n    If not.\n"
    assert script.markdown(f"Do it.\n\n{parameters}\n{raises}") == [
        "Do it.",
        "",
        "## Parameters",
        "",
        "- `x, y` (int): How often, at most.",
        "",
        "## Raises",
        "",
        "- `InputError`: If not.",
        "",
    ]
