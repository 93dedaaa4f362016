import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import COMMANDS, USAGE_ERROR, understand

from alloc.allocators import RefusedError
from alloc.allocators.registry import BUILT_IN, ENTRY_POINT_GROUP
from alloc.cli import options
from alloc.cli.commands import solve as solve_module

READERS = [name for name, one in COMMANDS.items() if one.params[0].name in ("instance", "instances", "source")]
"""Commands whose first argument is an instance."""


def python(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, env={**os.environ, **environment}, check=False
    )


def test_help_names_every_command_and_loads_no_numpy():
    """`alloc --help` lists all commands and the process has not imported numpy."""
    code = "import sys; from alloc.cli.main import main; main(['--help']); sys.exit('numpy' in sys.modules)"
    ran = python("-c", code)
    assert ran.returncode == 0
    assert all(f"\n  {command} " in ran.stdout for command in COMMANDS)


def test_command_summaries_fit_on_a_line():
    """Summaries in the list of commands fit on a line and differ."""
    listed = python("-m", "alloc", "--help", COLUMNS="80").stdout.split("Commands:\n")[1].split("\n\n")[0]
    lines = dict(line.split(maxsplit=1) for line in listed.splitlines())
    assert not [line for line in lines.values() if line.endswith("...")]
    assert len(set(lines.values())) == len(COMMANDS)
    assert lines["export-model"] == "The same as `alloc export`."


def test_commands_are_collected():
    """The parametrised checks cover all commands and all readers."""
    assert {"solve", "train"} < set(COMMANDS)
    assert {"solve", "compare", "convert"} < set(READERS) < set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_help_has_examples(alloc, command):
    """The help of every command has valid examples."""
    ran = alloc(command, "--help")
    assert ran.code == 0
    examples = [line for line in ran.out.split("Examples:")[1].splitlines() if line.strip().startswith("alloc ")]
    assert any(f"alloc {command}" in line for line in examples)
    for line in examples:
        understand(line)


@pytest.mark.parametrize(
    "line", ["alloc sulve x.json", "alloc solve x.json --nonsense", "cat | alloc solve x --seed a"]
)
def test_wrong_examples_are_detected(line):
    """Examples with unknown commands, options or values are detected."""
    with pytest.raises(USAGE_ERROR):
        understand(line)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_explained(command):
    """Every argument and option of every command has a help text."""
    assert [one.name for one in COMMANDS[command].params if not getattr(one, "help", None)] == []


@pytest.mark.parametrize("command", COMMANDS)
def test_unknown_options_are_one_line(alloc, command):
    """Every command refuses unknown options in one line, and does nothing."""
    ran = alloc(command, "--nonsense")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("alloc: ")
    assert "--nonsense" in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize("command", [name for name, one in COMMANDS.items() if one.params[0].required])
def test_missing_argument_is_one_line(alloc, command):
    """Every command that needs an argument says so in one line."""
    ran = alloc(command)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("alloc: ")
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize("module", ["alloc", "alloc.cli"])
def test_module_and_version(module):
    """`python -m alloc --version` prints the version, and so does the older `python -m alloc.cli`."""
    ran = python("-m", module, "--version")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.startswith("alloc 0.")


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("nonsense",),
        ("solve",),
        ("solve", "small.json", "--seed", "x"),
        ("solve", "small.json", "--objective", "cost"),
        ("solve", "small.json", "--time-limit", "-1"),
        ("solve", "small.json", "--time-limit", "nan"),
        ("solve", "small.json", "--method", "gredy"),
        ("solve", "small.json", "--method", "greedy", "--policy", "x"),
        ("solve", "small.json", "--plot", "picture.gif"),
        ("solve", "small.json", "--plot", "nowhere/picture.png"),
        ("solve", "small.json", "--output", "nowhere/result.json"),
        ("solve", "small.json", "--output", "."),
        ("solve", "nowhere.json", "--json"),
        ("solve", ".", "--json"),
        ("solve", "small.json", "--start", "small.json"),
        ("evaluate", "small.json", "nowhere.json", "--json"),
        ("evaluate", "-", "-"),
        ("validate", "nowhere.json", "--json"),
        ("convert", "small.json", "out.xyz"),
        ("convert", "nowhere.json", "-"),
        ("compare", "small.json", "--methods", "greedy,gredy"),
        ("compare", "small.json", "--methods", ","),
        ("compare", "small.json", "--methods", "greedy", "--seeds", "1,x"),
        ("compare", "small.json", "--methods", "greedy", "--seeds", "0"),
        ("pareto",),
        ("pareto", "nowhere.json", "--json"),
        ("pareto", "small.json", "--points", "0"),
        ("pareto", "small.json", "--method", "gredy"),
        ("pareto", "small.json", "--method", "greedy"),
        ("pareto", "small.json", "--time-limit", "nan"),
        ("pareto", "small.json", "--start", "small.json"),
        ("pareto", "small.json", "--plot", "picture.gif"),
        ("pareto", "small.json", "--output", "nowhere/front.json"),
        ("generate", "paper-5"),
        ("generate", "paper-1", "--agents", "3"),
        ("generate", "random", "--battery", "1:x"),
        ("generate", "random", "--range", "5:3"),
        ("generate", "random", "--agents", "0"),
        ("generate", "random", "--count", "2"),
        ("methods", "superfluous"),
        ("train", "ga", "--output", "p"),
    ],
)
def test_bad_usage_is_one_line(alloc, small, arguments):
    """Bad usage ends with exit code 2, one line on standard error and nothing on standard output."""
    ran = alloc(*arguments)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("alloc: ")
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "begin"),
    [
        (("solve", "small.json", "--time-limit", "inf"), "--time-limit: must be a finite number"),
        (("solve", "small.json", "--time-limit", "nan"), "--time-limit: must be a finite number >= 0, got nan"),
        (("solve", "small.json", "--target-gap", "nan"), "--target-gap: must be a finite number >= 0, got nan"),
        (("whatif", "small.json", "--time-limit", "nan", "--remove", "a1"), "--time-limit: must be a finite number"),
        (("train", "ppo", "--output", "p", "--minutes", "nan"), "--minutes: must be a finite number >= 0, got nan"),
        (
            ("solve", "small.json", "--method", "ga", "--set", "population=abc"),
            "--set population: must be a whole number >= 4, got 'abc'",
        ),
        (
            ("solve", "small.json", "--output", "small.json/best.json"),
            "small.json/best.json: cannot be written: 'small.json' is a file, not a folder",
        ),
        (
            ("generate", "random", "--output", "small.json/many", "--count", "2"),
            "small.json/many: cannot be written: 'small.json' is a file, not a folder",
        ),
        (
            ("convert", "small.json", "small.json/tables"),
            "small.json/tables: cannot be written: 'small.json' is a file, not a folder",
        ),
        (
            ("solve", "small.json", "--makespan-slack", "0.1"),
            "--makespan-slack: needs the objective makespan-energy or makespan-moves",
        ),
        (("solve", "small.json", "--method", "gredy"), "--method: there is no method 'gredy'"),
        (("solve", "small.json", "--method", "greedy", "--policy", "x"), "--policy: method 'greedy' takes no option"),
        (("pareto", "small.json", "--time-limit", "inf"), "--time-limit: must be a finite number"),
        (("compare", "small.json", "--methods", "gredy"), "--methods: there is no method 'gredy'"),
        (("compare", "small.json", "--methods", "greedy,ga[pop=1]"), "--methods: pop: method 'ga' takes no option"),
        (("compare", "small.json", "--methods", ","), "--methods: names no method, such as greedy"),
        (("generate", "random", "--count", "2", "--output", "g.json"), "--output: 'g.json' is the name of a file"),
        (("whatif", "small.json"), "--add: needs an agent to add copies of"),
        (("generate", "random", "--range", "5:3"), "--range: must be an ascending range"),
        (("generate", "covering", "--ability-min", "0"), "--ability-min: must be a whole number >= 1"),
        (("generate", "random", "--tau", "2"), "--tau: must lie strictly between 0 and 1"),
        (("train", "ga", "--output", "p"), "METHOD: 'ga' learns nothing"),
        (("train", "ppo", "--output", "p", "--set", "clip_coef=x"), "--set: clip_coef must be like"),
        (("train", "ppo", "--output", "p", "--workers", "2"), "--workers: belongs to the engine processes"),
        (("train", "ppo", "--output", "p", "--family", "x"), "--family: no such family"),
        (("solve", "small.json", "--seed", "x"), "--seed: "),
        (("solve", "small.json", "--threads", "0"), "--threads: "),
        (("generate", "paper-5"), "FAMILY: 'paper-5' is not one of"),
        (("solve", "small.json", "--set", "hearing"), "--set: must be NAME=VALUE, got 'hearing'"),
        (("solve", "small.json", "--set", "seed=3"), "--set: 'seed' is not a parameter of a method"),
        (("solve", "small.json", "--method", "ga", "--set", "hearing=3"), "--set hearing: method 'ga' takes no"),
    ],
)
def test_library_parameters_are_reported_as_options(alloc, small, arguments, begin):
    """Errors about parameters of the library name the option or argument of the command."""
    ran = alloc(*arguments)
    assert ran.code == 2
    assert ran.err.startswith(f"alloc: {begin}")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3", 3),
        ("-0.5", -0.5),
        ("1e3", 1000.0),
        ("true", True),
        ("False", False),
        ("none", None),
        ("2,3.5", (2, 3.5)),
        ("4,", (4,)),
        ("uniform", "uniform"),
        ("a,b", "a,b"),
        ("a=b", "a=b"),
        ("", ""),
    ],
)
def test_values_of_set_are_numbers_or_text(text, value):
    """Values of --set are parsed as numbers, tuples, booleans or None, or else are text."""
    (found,) = options.values([f"name={text}"]).values()
    assert (found, type(found)) == (value, type(value))


def test_set_reaches_the_method(alloc, small, monkeypatch):
    """--set NAME=VALUE, which may be repeated, is passed to `solve` with the other options."""
    given = {}

    def record(*arguments, **settings):
        given.update(settings)
        raise RefusedError("enough")

    monkeypatch.setattr("alloc.allocators.solve", record)
    alloc("solve", "small.json", "--method", "ga", "--set", "population=50", "--set", "rate=0.5", "--policy", "p")
    assert (given["population"], given["rate"], given["policy"]) == (50, 0.5, "p")


def test_fields_of_files_are_not_reported_as_options(alloc):
    """A field of a file with the name of an option is not reported as the option."""
    Path("bad.json").write_bytes(instance_of(b'"ability": 1').replace(b"{", b'{"tau": 2, ', 1))
    assert alloc("solve", "bad.json").err.startswith("alloc: bad.json: tau: must lie")


def test_out_of_memory_is_bad_input(alloc, small, monkeypatch):
    """An instance that does not fit into memory is bad input, not a defect."""

    def fail(*arguments, **options):
        raise MemoryError

    monkeypatch.setattr("alloc.allocators.solve", fail)
    ran = alloc("solve", "small.json")
    assert (ran.code, ran.err) == (2, "alloc: there is not enough memory for this\n")


def instance_of(agent: bytes, task: bytes = b'"workload": 1') -> bytes:
    parts = (
        b'{"format": "alloc-instance/1", "agents": [{"id": "a", ',
        agent,
        b'}], "tasks": [{"id": "t", ',
        task,
        b"}]}",
    )
    return b"".join(parts)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b"\xff\xfe\x00",
        b"[" * 5000,
        b'{"format": "alloc-instance/2", "agents": [], "tasks": []}',
        instance_of(b'"ability": NaN'),
        instance_of(b'"abilty": 1'),
        instance_of(b'"ability": 1', b'"workload": "x"'),
        instance_of(b'"ability": 1, "id": "b"'),
    ],
)
@pytest.mark.parametrize("command", READERS)
def test_malformed_files_are_one_line_with_the_file(alloc, tmp_path, command, content):
    """In every command, a malformed instance gives exit code 2 and one line that names the file."""
    Path("bad.json").write_bytes(content)
    more = {
        "convert": ["out.npz"],
        "evaluate": ["x.json"],
        "plot": ["x.json", "--output", "p.png"],
        "export": ["--output", "m.lp"],
        "export-model": ["--output", "m.lp"],
        "compare": ["--methods", "greedy"],
    }.get(command, ["--json"])
    ran = alloc(command, "bad.json", *more)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("alloc: bad.json: ")
    assert ran.err.count("\n") == 1


def test_unexpected_exceptions_are_one_line(alloc, small, monkeypatch):
    """An unexpected exception gives one line and its own exit code, and the traceback only on request."""

    def fail(*arguments, **options):
        raise ZeroDivisionError("in a plugin\nsomewhere")

    monkeypatch.setattr("alloc.allocators.solve", fail)
    ran = alloc("solve", "small.json")
    assert (ran.code, ran.out, ran.err.count("\n")) == (70, "", 1)
    assert "ZeroDivisionError: in a plugin somewhere" in ran.err
    monkeypatch.setenv("ALLOC_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        alloc("solve", "small.json")


@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (RefusedError("too large"), 2), (OSError(28, "full"), 2)]
)
def test_exit_codes_of_interrupts_refusals_and_disk_errors(alloc, small, monkeypatch, error, code):
    """Ctrl-C outside a run, refusals and failing disks are one line each; the latter are bad input."""

    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr("alloc.allocators.solve", fail)
    ran = alloc("solve", "small.json")
    assert (ran.code, ran.out) == (code, "")
    assert ran.err.count("\n") == 1


def test_completion_names_match_the_registry():
    """The names for completion, which does not load numpy, are those of the registry."""
    assert set(options.BUILT_IN_METHODS) == {"auto", *BUILT_IN}
    assert ENTRY_POINT_GROUP == "alloc.allocators"
    assert solve_module.EXAMPLES


@pytest.mark.parametrize(
    ("words", "count", "expected"),
    [
        ("alloc sol", 1, ["solve"]),
        ("alloc solve x.json --method g", 4, ["greedy", "ga", "gappo", "gappo-ls"]),
        ("alloc compare x.json --methods greedy,c", 4, ["greedy,cpsat"]),
        ("alloc solve x", 2, []),
    ],
)
def test_completion(words, count, expected):
    """Commands and methods are completed; paths are left to the shell."""
    ran = python(
        "-m",
        "alloc.cli",
        _PYTHON_M_ALLOC_CLI_COMPLETE="",
        _ALLOC_COMPLETE="complete_bash",
        COMP_WORDS=words,
        COMP_CWORD=str(count),
    )
    assert set(ran.stdout.split()) == set(expected)


def test_broken_pipe_is_no_error(small, tmp_path):
    """If standard output is closed early, as by `head`, the run ends normally without messages."""
    process = subprocess.Popen(
        [sys.executable, "-m", "alloc.cli", "solve", "small.json", "--method", "greedy", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    )
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    with process.stderr:
        assert process.stderr.read() == ""
    assert process.wait() == 0
