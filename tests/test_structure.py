"""The structure of the code: sizes of folders, files and functions, open types, and terms."""

import ast
import re
import statistics
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from command_line import COMMANDS

from alloc import allocators, cli, problems

PACKAGES = [Path(package.__path__[0]) for package in (problems, allocators, cli)]
FILES = {f"{package.name}/{path.relative_to(package)}": path for package in PACKAGES for path in package.rglob("*.py")}
SOURCES = {name: path.read_text(encoding="utf-8") for name, path in sorted(FILES.items())}

ROOT = Path(__file__).parents[1]
DOCUMENTS = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
}

Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def tree_of(name: str) -> ast.Module:
    """Return a module, parsed."""
    return ast.parse(SOURCES[name])


def functions() -> Iterator[tuple[str, int]]:
    """Yield the place and the number of lines of every function, without its docstring and decorators."""
    for name in SOURCES:
        for node in ast.walk(tree_of(name)):
            if isinstance(node, Function):
                yield f"{name}:{node.lineno} {node.name}", length(node)


def length(function: Function) -> int:
    """Return the lines of a function, without its docstring and decorators."""
    assert function.end_lineno is not None
    first = function.body[0]
    docstring = 0
    if ast.get_docstring(function, clean=False) is not None:
        assert first.end_lineno is not None
        docstring = first.end_lineno - first.lineno + 1
    return function.end_lineno - function.lineno + 1 - docstring


def test_folders_are_small() -> None:
    """No folder holds more than 14 modules."""
    folders = [name.rpartition("/")[0] for name in FILES]
    assert {folder: folders.count(folder) for folder in folders if folders.count(folder) > 14} == {}


def test_files_are_small() -> None:
    """No module has more than 300 lines, and half of them have at most 120."""
    lines = {name: len(source.splitlines()) for name, source in SOURCES.items()}
    assert {name: count for name, count in lines.items() if count > 300} == {}
    assert statistics.median(lines.values()) <= 120


def test_functions_are_small() -> None:
    """No function has more than 60 lines besides its docstring, and half of them have at most 12."""
    lines = dict(functions())
    assert {place: count for place, count in lines.items() if count > 60} == {}
    assert statistics.median(lines.values()) <= 12


def test_length_leaves_docstrings_and_decorators_out() -> None:
    """A decorated function of two lines with a docstring of three lines counts as two."""
    (function,) = ast.parse('@cache\ndef f():\n    """One.\n\n    Two.\n    """\n    return 1\n').body
    assert isinstance(function, ast.FunctionDef)
    assert length(function) == 2


def annotations(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield every annotation of a module: of parameters, of return values and of variables."""
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
            yield node.annotation
        elif isinstance(node, Function) and node.returns is not None:
            yield node.returns


def test_types_are_rarely_left_open() -> None:
    """`Any` stands in fewer than 40 annotations of the whole project."""
    found = {
        name: sum(len(re.findall(r"\bAny\b", ast.unparse(one))) for one in annotations(tree_of(name)))
        for name, source in SOURCES.items()
        if "Any" in source
    }
    assert sum(found.values()) < 40, {name: count for name, count in found.items() if count}


OLD_WORDS = (
    "aims", "chain", "chains", "contested", "deficit", "easiest", "ground", "hearing", "holdup", "in vain", "kin",
    "lane", "lanes", "lesson", "lessons", "minds", "shake", "story", "survey", "taught", "teach", "thrift", "upset",
    "wander", "wanders", "worth",
)  # fmt: skip
"""Words that are no terms of the field; docs/glossary.md has those."""

OLD_NAMES = (
    *OLD_WORDS, "apart", "ask", "cover", "crew", "know places", "lack", "lacks", "question", "see places", "settle",
    "settled", "supply", "watch", "world",
)  # fmt: skip
"""Words that are plain English in a sentence, but do not name anything in the field."""

ALLOWED = (
    r"Markov chains?",  # the terms of the field
    r"[Ee]jection chains?",
    r"ground[ _](station|truth)s?",  # likewise
    r"survey drones?",  # the agents of an example
    r"world[ _-]size",  # side of the square or cube of generated instances, an option
    r"--lesson",  # former name of an option, still accepted
    r"supply[ _]ratios?",  # total ability over total workload
    r"exception chain",
)
"""Contexts in which an old word is the right one."""


@cache
def pattern(words: tuple[str, ...]) -> re.Pattern[str]:
    """Return what finds any of some words, as whole words."""
    return re.compile(rf"\b(?:{'|'.join(words)})\b")


def old_words(text: str, words: tuple[str, ...] = OLD_WORDS) -> list[str]:
    """Return the old words in a text, or in a name whose parts are joined by underscores or capital letters."""
    text = re.sub("|".join(ALLOWED), "", text, flags=re.IGNORECASE)
    separated = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).replace("_", " ").lower()
    return sorted({*pattern(words).findall(separated)})


def lines_with_old_words(texts: dict[str, str], words: tuple[str, ...] = OLD_WORDS) -> dict[str, list[str]]:
    """Return the old words of each line that has some, by the name of its text and its number."""
    return {
        f"{name}:{number}": found
        for name, text in texts.items()
        if old_words(text, words)  # at once, as hardly any text has one
        for number, line in enumerate(text.splitlines(), 1)
        if (found := old_words(line, words))
    }


def names(tree: ast.Module) -> Iterator[str]:
    """Yield every name that a module gives: to classes, functions, parameters, variables and attributes."""
    for node in ast.walk(tree):
        if isinstance(node, Function | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr


def test_names_are_terms_of_the_field() -> None:
    """No module, class, function, parameter, variable or attribute is called by an old word."""
    given = {
        name: "\n".join([name.replace("/", "_").removesuffix(".py"), *sorted({*names(tree_of(name))})])
        for name in SOURCES
    }
    assert lines_with_old_words(given, OLD_NAMES) == {}


def test_sentences_use_terms_of_the_field() -> None:
    """No docstring, comment or message of the code has an old word."""
    assert lines_with_old_words(SOURCES) == {}


def test_documents_use_terms_of_the_field() -> None:
    """No page of the documentation has an old word."""
    assert lines_with_old_words(DOCUMENTS) == {}


@pytest.mark.parametrize("command", COMMANDS)
def test_help_uses_terms_of_the_field(command: str) -> None:
    """No option that the help shows, and no text of it, has an old word."""
    shown = [one for one in COMMANDS[command].params if not getattr(one, "hidden", False)]
    texts = [COMMANDS[command].help or "", *(f"{' '.join(one.opts)} {getattr(one, 'help', '')}" for one in shown)]
    assert {text: found for text in texts if (found := old_words(text, OLD_NAMES))} == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("GameLanes", ["lanes"]),
        ("lane_count", ["lane"]),
        ("the worth of a state", ["worth"]),
        ("it is searched in vain", ["in vain"]),
        ("background, a survey drone, planes", []),
        ("a Markov chain, an ejection chain", []),
    ],
)
def test_old_words_are_found_as_whole_words(text: str, found: list[str]) -> None:
    """Words are found in any spelling of a name, not within other words, and not where they are terms."""
    assert old_words(text) == found


def test_a_line_with_an_old_word_is_found_among_others() -> None:
    """The line is named where a text has one, whatever else is in it."""
    texts = {"a.md": "an ejection chain\nof lanes\nas before", "b.md": "nothing"}
    assert lines_with_old_words(texts) == {"a.md:2": ["lanes"]}
