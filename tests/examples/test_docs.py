"""Python blocks and `alloc` commands in the documents run; commands that take too long are parsed."""

import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_line import USAGE_ERROR, understand

from alloc.cli.main import main

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
NOT_RUN = re.compile(r"<!--\s*not run:\s*\S.*?-->\s*\Z", re.DOTALL)
INDENTED = re.compile(r"^(?: {4})+(?=\S)(.*)$", re.MULTILINE)
SCRIPT = re.compile(r"python (\S+\.py)")
SHELL = re.compile(r"[^\w\s.,=:/-]")
COMMAND_LANGUAGES = ("console", "bash", "sh", "shell")


@dataclass(frozen=True)
class Block:
    """Code between fences, and the line where it begins."""

    language: str
    code: str
    line: int
    is_run: bool


def blocks(text):
    """Return the blocks of a document; not run are those with ``<!-- not run: reason -->`` right before them."""
    return [
        Block(
            match[1],
            match[2],
            text.count("\n", 0, match.start()) + 2,
            not NOT_RUN.search(text[: match.start()]),
        )
        for match in FENCE.finditer(text)
    ]


def runs(block):
    """Return whether a test of the document runs something in the block."""
    return block.is_run and (
        block.language == "python" or (block.language in COMMAND_LANGUAGES and bool(commands(block.code)))
    )


def commands(code):
    """Return the commands that begin with ``alloc``, with or without a prompt, including continuation lines."""
    joined = code.replace("\\\n", " ")
    lines = (line.removeprefix("$ ").strip() for line in joined.splitlines())
    return [line for line in lines if line.startswith("alloc ")]


def shown(text):
    """Return the commands in a document that are not run: indented, or in a block that is not run."""
    indented = "\n".join(match[1] for match in INDENTED.finditer(FENCE.sub("", text)))
    code = [
        indented,
        *(block.code for block in blocks(text) if block.language in COMMAND_LANGUAGES and not runs(block)),
    ]
    lines = "\n".join(code).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith(("alloc ", "python ", "make ")) or "| alloc " in line]


def fault(line):
    """Return the error of a command, or nothing if the parser, the script or the Makefile accepts it."""
    try:
        understand(line)
    except USAGE_ERROR as error:
        return str(error)
    if script := SCRIPT.match(line):
        if not (ROOT / script[1]).is_file():
            return "no such script"
        source = (ROOT / script[1]).read_text("utf-8")
        return next((option for option in re.findall(r"--[a-z-]+", line) if f'"{option}"' not in source), None)
    if line.startswith("make ") and not re.search(
        rf"^{line.split()[1]}:", (ROOT / "Makefile").read_text(), re.MULTILINE
    ):
        return "no such target"
    return None


def run_document(text, name, folder):
    """Run all blocks of a document in order, in one namespace and one folder; the first of README as a user does."""
    namespace, by_shell = {"__name__": "document"}, name == "README.md"
    for block in filter(runs, blocks(text)):
        if block.language == "python":
            exec(compile("\n" * (block.line - 1) + block.code, name, "exec"), namespace)
        else:
            for command in commands(block.code):
                code, errors = run_by_shell(command, folder) if by_shell or SHELL.search(command) else run_here(command)
                assert code == 0, f"{name}:{block.line}: {command}\n{errors}"
                by_shell = False


def run_by_shell(command, folder):
    """Run a command as a user does; return its exit code and what it prints on standard error."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    bash = ["bash", "-o", "pipefail", "-c", command]
    done = subprocess.run(
        bash, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True, timeout=100, check=False
    )
    return done.returncode, done.stderr


def run_here(command):
    """Do as `run_by_shell`, but in this process, which has loaded all packages; for commands without shell syntax."""
    with redirect_stdout(io.TextIOWrapper(io.BytesIO())), redirect_stderr(io.StringIO()) as errors:
        return main(shlex.split(command)[1:]), errors.getvalue()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Change to a folder with a copy of the examples, and return it."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("*.egg-info", "build"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


TEXTS = {path: path.read_text(encoding="utf-8") for path in DOCUMENTS}
RUN = [path for path, text in TEXTS.items() if any(map(runs, blocks(text)))]
SHOWN = [(path, line) for path, text in TEXTS.items() for line in shown(text)]
WITHOUT_CODE = {
    "docs/benchmarks/index.md",
    "docs/developing/architecture.md",
    "docs/glossary.md",
    "docs/paper/paper.md",
    *(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs" / "reference").rglob("*.md")),
}
"""Documents that show neither code nor commands: nothing of them is tested here but their links."""


def name(path):
    return path.relative_to(ROOT).as_posix() if isinstance(path, Path) else None


def test_every_document_is_tested_or_has_no_code():
    """Documents that are run, parsed, or known to have no code, are all of docs/ and README."""
    tested = {name(path) for path in RUN} | {name(path) for path, _ in SHOWN}
    assert {name(path) for path in DOCUMENTS} == tested | WITHOUT_CODE
    assert not tested & WITHOUT_CODE
    assert {"README.md", "docs/use/cli.md"} < tested


LONG = {
    "docs/missions/missions.md",
    "docs/missions/records.md",
    "docs/missions/missions_tutorial.md",
    "docs/use/comparing.md",
    "docs/use/cli.md",
    "docs/data/outputs.md",
}
"""Documents whose commands take some seconds of processor time each, and are left to CI."""


@pytest.mark.parametrize(
    "document", [pytest.param(path, marks=[pytest.mark.slow] * (name(path) in LONG)) for path in RUN], ids=name
)
def test_document_runs(document, folder):
    """Every block of the document runs to its end."""
    run_document(TEXTS[document], name(document), folder)


@pytest.mark.parametrize(("document", "line"), SHOWN, ids=name)
def test_commands_that_are_not_run_are_valid(document, line):
    """Commands that are not run have valid options and values, and scripts and targets that exist."""
    assert fault(line) is None, f"{name(document)}: {line}"


@pytest.mark.parametrize("document", [*DOCUMENTS, *sorted((ROOT / "examples").rglob("README.md"))], ids=str)
def test_links_are_valid(document):
    """Every relative link of the document names a file or folder of the checkout."""
    assert broken_links(document.read_text(encoding="utf-8"), document.parent) == []


def broken_links(text, folder):
    return [target for target in LINK.findall(text) if ":" not in target and not (folder / target).exists()]


def test_broken_links_are_detected():
    """Links to missing files are detected; links to files, anchors and other hosts are accepted."""
    text = "[a](absent.md) [b](test_docs.py) [c](test_docs.py#links) [d](https://example.org/absent.md)"
    assert broken_links(text, Path(__file__).parent) == ["absent.md"]


@pytest.mark.parametrize(
    "line",
    [
        "    alloc solve x.json --nonsense",
        "    alloc generate paper-1 --output - | alloc sulve -",
        "    python tests/benchmarks/absent.py",
        "    python tests/benchmarks/growth.py --nonsense",
        "<!-- not run: takes an hour -->\n```console\nalloc train gappo --nonsense\n```\n",
        "```console\nmake nonsense\n```\n",
    ],
)
def test_wrong_lines_that_are_not_run_are_detected(line):
    """Unknown commands, options, scripts and targets are detected, indented or in a block that is not run."""
    (found,) = shown(f"# Title\n\n{line}\n")
    assert fault(found) is not None


def test_wrong_python_is_detected(folder):
    """A block that raises fails its document, with the line in the document."""
    with pytest.raises(AssertionError) as caught:
        run_document("# Title\n\n```python\nx = 1\n```\n\n```python\nassert x == 2\n```\n", "wrong.md", folder)
    assert caught.traceback[-1].lineno + 1 == 8


def test_wrong_command_is_detected(folder):
    """A failing command fails its document, also after a pipe, on a second line or after other commands."""
    for command in (
        "alloc solve absent.json",
        "alloc solve absent.json --json | cat",
        "alloc solve \\\n  absent.json",
        "alloc methods\n$ alloc solve absent.json",
    ):
        with pytest.raises(AssertionError, match=r"absent\.json.*\n.*there is no such file"):
            run_document(f"```console\n$ {command}\n```\n", "wrong.md", folder)


def test_blocks_are_skipped_only_with_a_reason(folder):
    """Only a comment with a reason, right before a block, leaves that block out."""
    wrong = "```python\nraise RuntimeError\n```\n"
    run_document(f"<!-- not run: takes an hour -->\n{wrong}", "document.md", folder)
    for comment in ("", "<!-- not run: -->\n", "<!-- not run: takes an hour -->\n```python\npass\n```\n"):
        with pytest.raises(RuntimeError):
            run_document(comment + wrong, "document.md", folder)
