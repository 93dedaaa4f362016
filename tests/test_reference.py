"""docs/reference.md is what its script makes of the docstrings, and has every public name."""

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


def test_the_page_is_up_to_date(script: ModuleType) -> None:
    """The page is that of the docstrings; `python docs/make_reference.py` writes it anew."""
    assert (DOCS / "reference.md").read_text(encoding="utf-8") == script.reference()


@pytest.mark.parametrize("module", [problems, allocators], ids=lambda module: module.__name__)
def test_no_public_name_is_missing(module: ModuleType) -> None:
    """Every name in `__all__` has a heading, and more than a heading."""
    page = (DOCS / "reference.md").read_text(encoding="utf-8")
    chapter = page.split(f"## {module.__name__}\n")[1].split("\n## ")[0]
    entries = dict(re.findall(r"^### (\w+)\n(.*?)(?=^### |\Z)", chapter, re.MULTILINE | re.DOTALL))
    assert set(entries) == set(module.__all__)
    assert [name for name, text in entries.items() if len(text.split()) < 3] == []


def test_sections_of_docstrings_become_lists(script: ModuleType) -> None:
    """Parameters are items with their types, exceptions with their reasons, and plain sections stay text."""
    parameters = "Parameters\n----------\nx, y : int\n    How often,\n    at most.\n"
    raises = "Raises\n------\nInputError\n    If not.\n"
    assert script.markdown(f"Do it.\n\n{parameters}\n{raises}") == [
        "Do it.",
        "",
        "**Parameters**",
        "",
        "- `x, y` (int): How often, at most.",
        "",
        "**Raises**",
        "",
        "- `InputError`: If not.",
        "",
    ]
