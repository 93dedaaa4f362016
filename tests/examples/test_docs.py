"""What the documents show runs: their Python blocks, and their `alloc` commands."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
NOT_RUN = re.compile(r"<!--\s*not run:\s*\S.*?-->\s*\Z", re.DOTALL)
COMMAND_LANGUAGES = ("console", "bash", "sh", "shell")


@dataclass(frozen=True)
class Block:
    """Code between fences, and the line where it begins."""

    language: str
    code: str
    line: int


def blocks(text):
    """Return the blocks of a document but those with ``<!-- not run: reason -->`` right before them."""
    return [
        Block(match[1], match[2], text.count("\n", 0, match.start()) + 2)
        for match in FENCE.finditer(text)
        if not NOT_RUN.search(text[: match.start()])
    ]


def commands(code):
    """Return the commands that begin with ``alloc``, behind a prompt or not, with the lines that they go on over."""
    joined = code.replace("\\\n", " ")
    lines = (line.removeprefix("$ ").strip() for line in joined.splitlines())
    return [line for line in lines if line.startswith("alloc ")]


def run_document(text, name, folder):
    """Run all blocks of a document in order, in one namespace and one folder."""
    namespace = {"__name__": "document"}
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    for block in blocks(text):
        if block.language == "python":
            exec(compile("\n" * (block.line - 1) + block.code, name, "exec"), namespace)
        elif block.language in COMMAND_LANGUAGES:
            for command in commands(block.code):
                done = subprocess.run(
                    ["bash", "-o", "pipefail", "-c", command],
                    cwd=folder,
                    env=environment,
                    capture_output=True,
                    text=True,
                    timeout=100,
                    check=False,
                )
                assert done.returncode == 0, f"{name}:{block.line}: {command}\n{done.stderr}"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return an empty folder but for a copy of the examples, and go there."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("*.egg-info", "build"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_document_runs(document, folder):
    """Every block of the document runs to its end."""
    run_document(document.read_text(encoding="utf-8"), document.name, folder)


@pytest.mark.parametrize("document", [*DOCUMENTS, *sorted((ROOT / "examples").rglob("README.md"))], ids=str)
def test_links_lead_somewhere(document):
    """Every relative link of the document names a file or folder of the checkout."""
    targets = [target for target in LINK.findall(document.read_text(encoding="utf-8")) if ":" not in target]
    assert [target for target in targets if not (document.parent / target).exists()] == []


def test_wrong_python_is_noticed(folder):
    """A block that raises fails its document, with the line in the document."""
    with pytest.raises(AssertionError) as caught:
        run_document("# Title\n\n```python\nx = 1\n```\n\n```python\nassert x == 2\n```\n", "wrong.md", folder)
    assert caught.traceback[-1].lineno + 1 == 8


def test_wrong_command_is_noticed(folder):
    """A command that fails, also behind a pipe or on a second line, fails its document."""
    for command in ("alloc solve absent.json", "alloc solve absent.json --json | cat", "alloc solve \\\n  absent.json"):
        with pytest.raises(AssertionError, match=r"absent\.json"):
            run_document(f"```console\n$ {command}\n```\n", "wrong.md", folder)


def test_blocks_are_left_out_for_a_reason_alone(folder):
    """Only a comment with a reason, right before a block, leaves that block out."""
    wrong = "```python\nraise RuntimeError\n```\n"
    run_document(f"<!-- not run: takes an hour -->\n{wrong}", "document.md", folder)
    for comment in ("", "<!-- not run: -->\n", "<!-- not run: takes an hour -->\n```python\npass\n```\n"):
        with pytest.raises(RuntimeError):
            run_document(comment + wrong, "document.md", folder)
