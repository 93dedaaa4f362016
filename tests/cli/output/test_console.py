import io
import json
import sys

import pytest

from alloc.cli.main import main
from alloc.cli.output.console import is_terminal, say, table, to_json
from alloc.cli.output.files import check_output
from alloc.problems import InputError
from alloc.problems.text import one_line, percent


def test_control_characters_cannot_break_the_line():
    """Messages stay on one line, whatever characters ids or file names contain."""
    assert one_line("a\nb\x1b[2J\tc") == "a b [2J c"


@pytest.mark.parametrize(
    ("share", "text"), [(None, "-"), (0.0, "0 %"), (4e-7, "0 %"), (0.0321, "3.2 %"), (1.0, "100 %"), (0.5, "50 %")]
)
def test_percentages(share, text):
    """Shares are readable, and proven gaps are 0 %."""
    assert percent(share) == text


def test_table_is_aligned():
    """Text is left-aligned, numbers are right-aligned."""
    assert table(["id", "T"], [["a", "10"], ["bcd", "9"]]) == "id    T\n---  --\na    10\nbcd   9"


def test_wide_characters_take_two_columns():
    """Columns stay aligned beside names in Chinese or with combining accents."""
    assert table(["id", "T"], [["\u540d\u524d", "1"], ["e\u0301", "2"]]) == (
        "id    T\n----  -\n\u540d\u524d  1\ne\u0301     2"
    )


def test_unencodable_characters_are_escaped(monkeypatch):
    """Characters that a terminal cannot encode are escaped, without an exception."""
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stderr", stream)
    say("Z\u00fcrich")
    assert stream.buffer.getvalue() == b"Z\\xfcrich\n"  # type: ignore[attr-defined]


def test_write_protected_files_are_reported_before_the_run(tmp_path, monkeypatch):
    """A write-protected file is detected before the run, with the same error as on writing."""
    (tmp_path / "x.json").touch()
    monkeypatch.setattr("os.access", lambda path, mode: False)
    with pytest.raises(InputError, match="cannot be written: it is write-protected"):
        check_output(str(tmp_path / "x.json"))


class Bare:
    """A minimal replacement of a stream, which only has `write`."""

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> None:
        self.text += text


def test_streams_with_only_write(alloc, small, monkeypatch):
    """No command needs `isatty` or `flush`; a closed stream is not a terminal."""
    for arguments in (
        ("solve", "small.json", "--method", "greedy"),
        ("compare", "small.json", "--methods", "greedy"),
        ("pareto", "small.json", "--points", "1", "--iterations", "1", "--method", "local-search"),
    ):
        error, out = Bare(), Bare()
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stderr", error)
            patch.setattr(sys, "stdout", out)
            assert main([*arguments, "--json"]) == 0
            assert main(arguments) == 0
        assert json.loads(out.text)
        assert "T" in error.text or "makespan" in error.text
    closed = io.StringIO()
    closed.close()
    assert not is_terminal(closed)


@pytest.mark.parametrize(
    "value",
    [
        {},
        [],
        3,
        [1, {"a": 2}],
        {"a": {}, "b": [], "c": {"x": None, "é\n": '"q"'}, "d": [{"x": [1, 2]}], "e": {"q": 1}},
        {"t": {"k": {"j": "x"}}},
    ],
)
def test_json_matches_the_standard_library(value: object) -> None:
    """The fast encoding of large objects gives the same text."""
    assert to_json(value) == json.dumps(value, indent=2) + "\n"
