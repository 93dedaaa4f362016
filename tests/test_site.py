"""The site of the documents: it has all pages, links have targets in it, and nothing is loaded from other hosts."""

import importlib.util
import json
import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from command_line import COMMANDS

from alloc import allocators, problems
from alloc.allocators.contract.built_in import BUILT_IN

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


def loaded(name: str) -> ModuleType:
    """Return a script of docs/ as a module."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def hooks(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """What mkdocs calls."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    return loaded("hooks")


def test_every_page_is_in_the_navigation() -> None:
    """Each page of docs/ outside the reference is once in mkdocs.yml, and each listed page exists or is generated."""
    made = {
        "use/commands.md",
        *(f"examples/notebooks/{path.stem}.md" for path in ROOT.glob("examples/notebooks/*.ipynb")),
    }
    named = re.findall(r": ([\w/.-]+\.md)(?:  #|$)", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE)
    names = {*DOCS.glob("reference/*/*.md")}
    pages = {path.relative_to(DOCS).as_posix() for path in {*DOCS.rglob("*.md")} - names}
    assert len(named) == len(set(named))
    assert set(named) == pages | made | {"examples/README.md", "CONTRIBUTING.md", "CHANGELOG.md"}


def test_lists_are_preceded_by_empty_lines() -> None:
    """A list after a paragraph needs an empty line before it to be rendered as a list."""
    found = {}
    for path in [*DOCS.rglob("*.md"), ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]:
        text = re.sub(r"^```.*?^```", "", path.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
        found[str(path)] = re.findall(r"^(?!- |\d+\. |#| |\||<!--).+\n(?=- |1\. )", text, re.MULTILINE)
    assert {name: lines for name, lines in found.items() if lines} == {}


def test_page_of_options_is_complete() -> None:
    """Every command has a section with each option in its help."""
    page = loaded("make_commands").page()
    chapters = dict(re.findall(r"^## alloc ([\w-]+)\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL))
    assert set(chapters) == set(COMMANDS)
    for name, command in COMMANDS.items():
        shown = [one for one in command.params if not getattr(one, "hidden", False)]
        assert [
            option for one in shown for option in one.opts if option.startswith("--") and option not in chapters[name]
        ] == []


def test_table_of_methods_matches_their_capabilities() -> None:
    """Each method has a linked page, and the marks of the table match its description."""
    page = (DOCS / "methods" / "index.md").read_text("utf-8")
    rows = re.findall(r"^\| (`[^|]*`) \|(.*)\|$", page.split("## What each can do")[1].split("## ")[0], re.MULTILINE)
    found = {
        name: [cell.strip() == "yes" for cell in cells.split("|")]
        for names, cells in rows
        for name in re.findall(r"`([\w-]+)`", names)
    }
    assert found == {
        one.name: [one.finite_speeds, one.makespan_slack, one.warm_start, one.anytime, one.proves]
        for one in BUILT_IN.values()
    }
    for name in BUILT_IN:
        assert re.search(rf"\[[^\]]*`{name}`[^\]]*\]\([\w-]+\.md\)", page), name


def test_diagram_of_layers_has_every_package() -> None:
    """Every folder of a package is in the diagram of the architecture."""
    picture = (DOCS / "developing" / "architecture.svg").read_text("utf-8")
    folders = [
        path.parent.name
        for package in (allocators, problems)
        for path in Path(package.__path__[0]).glob("*/__init__.py")
    ]
    assert [name for name in folders if f"{name}/" not in picture] == []


def test_notebook_becomes_a_page(tmp_path: Path) -> None:
    """Text is kept, code and its output are fenced, and pictures are separate files beside the page."""
    png = {"output_type": "execute_result", "data": {"image/png": ["aGk=\n"], "text/plain": ["<Image>"]}}
    said = {"output_type": "stream", "text": ["1\n", "2\n"]}
    cells = [
        {"cell_type": "markdown", "source": ["# Title\n", "Words"]},
        {"cell_type": "code", "source": ["print(1)\n", "print(2)"], "outputs": [said, png]},
    ]
    path = tmp_path / "a.ipynb"
    path.write_text(json.dumps({"cells": cells}))
    text, pictures = loaded("make_notebooks").page(path)
    assert pictures == {"a-1.png": b"hi"}
    assert text.split("\n\n") == [
        "# Title",
        "[The notebook itself](a.ipynb).\nWords",
        "```python\nprint(1)\nprint(2)\n```",
        "```text\n1\n2\n```",
        "![Output of the cell above](a-1.png)\n",
    ]


@pytest.mark.needs("mkdocs")
def test_links_out_of_docs_point_into_the_site(hooks: ModuleType) -> None:
    """Files outside docs/ are copied into the site, and a label that is a file name becomes its title."""
    assert hooks.site_links("[e](../../examples/replan.py)", "use/replanning.md") == "[e](../examples/replan.py)"
    assert hooks.site_links("[p](../../examples/plugin)", "use/plugins.md") == "[p](../examples/plugin/README.md)"
    assert hooks.site_links("[a](docs/glossary.md#x)", "CONTRIBUTING.md") == "[a](glossary.md#x)"
    assert hooks.site_links("[cli.md](cli.md)", "use/embedding.md") == "[The command line](cli.md)"
    assert hooks.site_links("[h](https://example.org/a.md)", "index.md") == "[h](https://example.org/a.md)"


@pytest.mark.needs("mkdocs")
def test_classes_are_linked_to_the_reference(hooks: ModuleType) -> None:
    """Class names in sentences are linked; those in code, headings and links, and functions, are not."""
    reference = {"Search": "reference/classes/Search.md", "solve": "reference/functions/solve.md"}
    for text in (
        "```python\n`Search`\n```",
        "    a `Search`",
        "# `Search`",
        "[`Search`](x.md)",
        "`solve`",
        "`Searches`",
    ):
        assert hooks.reference_links(text, "use/a.md", reference) == text
    page = hooks.reference_links("# `Search`\n\na `Search`.", "use/a.md", reference)
    assert page == "# `Search`\n\na [`Search`](../reference/classes/Search.md)."
    own = hooks.reference_links("a `Search` of `solve`.", "reference/classes/Search.md", reference)
    assert own == "a `Search` of [`solve`](../functions/solve.md)."


@pytest.mark.needs("mkdocs")
def test_navigation_has_a_page_for_each_name(hooks: ModuleType) -> None:
    """Pages of the reference are in the navigation once, by topic, below the index."""
    nav = [{"Reference": [{"Python": "reference/index.md"}]}]
    config = hooks.on_config(SimpleNamespace(nav=nav))
    index, *topics = config.nav[0]["Reference"][0]["Python"]
    pages = [page for topic in topics for (found,) in [topic.values()] for page in found]
    assert index == "reference/index.md"
    assert sorted(pages) == sorted(path.relative_to(DOCS).as_posix() for path in DOCS.glob("reference/*/*.md"))


@pytest.mark.needs("mkdocs")
def test_network_resources_are_detected(hooks: ModuleType) -> None:
    """Scripts, styles and pictures of other hosts are detected; local files and links for readers are allowed."""
    for text in (
        '<script src="https://x.org/a.js">',
        '<link rel="stylesheet" href="https://x.org/a.css">',
        "<img src=http://x.org/a.png>",
    ):
        assert hooks.EXTERNAL.search(text)
    for text in ('<script src="../a.js">', '<a href="https://x.org">', '<link rel="canonical" href="https://x.org/">'):
        assert not hooks.EXTERNAL.search(text)
