"""Every `path:name` in the documents exists, and every part of the paper is discussed."""

import ast
import re
from pathlib import Path

import pytest

import alloc.problems

ROOT = Path(__file__).parents[1]
CODE = Path(alloc.problems.__file__).parents[1]  # where it is installed: beside the documents, or not
PAGES = ("paper/paper.md", "methods/gappo.md")


def text_of(page: str) -> str:
    return (ROOT / "docs" / page).read_text("utf-8")


def references(page: str) -> list[tuple[str, str]]:
    return re.findall(r"`([\w/]+\.py):([\w.]+)`", text_of(page))


def defines(body: list[ast.stmt], name: str) -> bool:
    """Whether statements define a function, a class, a constant or a field, or by dots a member of a class."""
    first, _, rest = name.partition(".")
    for node in body:
        if isinstance(node, ast.ClassDef) and node.name == first:
            return not rest or defines(node.body, rest)
        if isinstance(node, ast.FunctionDef) and node.name == first:
            return not rest
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == first for target in targets):
            return not rest
    return False


@pytest.mark.parametrize("page", PAGES)
def test_every_name_exists_in_the_code(page: str) -> None:
    """Functions, classes and constants mentioned in the pages exist at the given place."""
    named = references(page)
    files = {path: (ROOT if path.startswith("examples/") else CODE) / path for path, _ in named}
    missing = [f"{path}:{name}" for path, name in named if not files[path].is_file()]
    trees = {path: ast.parse(file.read_text("utf-8")).body for path, file in files.items() if file.is_file()}
    missing += [f"{path}:{name}" for path, name in named if path in trees and not defines(trees[path], name)]
    assert len(named) > 3
    assert missing == []


def test_unknown_names_are_detected() -> None:
    """Wrong functions and wrong members of a class are detected."""
    body = ast.parse("LIMIT = 1\nclass A:\n    size: int = 2\n    def go(self): ...\n").body
    assert [defines(body, name) for name in ("LIMIT", "A", "A.size", "A.go")] == [True] * 4
    assert [defines(body, name) for name in ("go", "A.stop", "LIMIT.x", "A.go.x")] == [False] * 4


def test_every_part_of_the_paper_is_covered() -> None:
    """Equations 1 to 19, all 39 lines of Algorithm 1, Table 1 and figures 1 to 6 are discussed."""
    text = text_of("paper/paper.md")
    assert [int(number) for number in re.findall(r"\*\*\((\d+)\)\*\*", text)] == list(range(1, 20))
    rows = re.findall(r"^\| (\d+)(?:-(\d+))? \|", text, re.MULTILINE)
    lines = [line for first, last in rows for line in range(int(first), int(last or first) + 1)]
    assert lines == list(range(1, 40))
    assert all(part in text for part in ("**Table 1.**", "figure 1.**", "**Figures 2 to 5.**", "**Figure 6.**"))
