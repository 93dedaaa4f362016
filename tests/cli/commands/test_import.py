"""``alloc import``."""

from pathlib import Path

import pytest

from alloc.problems.formats import read_instance

AGENTS = "Drone;Payload;Comment\nd1;4,5;\nd2;2;\nTotal;6,5;\n"
TASKS = "Site,Load\ns1,3\ns2,5\n"


@pytest.fixture
def tables(alloc):
    """Two spreadsheets in the working folder."""
    Path("agents.csv").write_text(AGENTS)
    Path("tasks.csv").write_text(TASKS)


def run(alloc, *options):
    return alloc("import", "--agents", "agents.csv", "--tasks", "tasks.csv", *options)


@pytest.mark.usefixtures("tables")
def test_guesses_are_reported(alloc):
    """Each column, and each omission, has a line on standard error; the instance can be solved."""
    ran = run(alloc, "--output", "fleet.json")
    assert (ran.code, ran.out) == (0, "")
    assert ran.err.splitlines() == [
        "agents.csv: Drone -> id",
        "agents.csv: Payload -> ability",
        "agents.csv: Comment: ignored",
        "agents.csv: line 4 is a total ('Total') and is left out",
        "tasks.csv: Site -> id",
        "tasks.csv: Load -> workload",
        "wrote fleet.json: 2 agents, 2 tasks",
    ]
    instance = read_instance("fleet.json")
    assert (instance.name, instance.agent_ids, instance.ability.tolist()) == ("fleet", ("d1", "d2"), [4.5, 2])
    assert alloc("solve", "fleet.json", "--method", "greedy", "--quiet").code == 0


@pytest.mark.usefixtures("tables")
def test_solving_a_table_refers_to_import(alloc):
    """Solving a single table gives an error that refers to `alloc import`."""
    ran = alloc("solve", "tasks.csv")
    assert (ran.code, len(ran.err.splitlines())) == (2, 1)
    assert "combine two tables with `alloc import`" in ran.err


@pytest.mark.usefixtures("tables")
def test_dash_writes_json_to_standard_output(alloc):
    """`-` writes only JSON; `--quiet` prints nothing."""
    ran = run(alloc, "--output", "-", "--quiet")
    assert (ran.code, ran.err, ran.json["name"]) == (0, "", "agents")


@pytest.mark.usefixtures("tables")
def test_columns_can_be_mapped_by_the_user(alloc):
    """`--map` accepts several fields, texts with commas and blanks, and numbers for all rows."""
    Path("tasks.csv").write_text('"Job, no",Length of work\ns1,3\ns2,5\n')
    ran = run(alloc, "--map", "tasks.id=Job, no,workload=Length of work,ability=2", "--output", "fleet.json")
    assert ran.code == 0, ran.err
    instance = read_instance("fleet.json")
    assert (instance.task_ids, instance.workload.tolist()) == (("s1", "s2"), [3, 5])
    assert instance.ability.tolist() == [2, 2]


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--map", "foo=Drone"], "alloc: --map: there is no field 'foo'"),
        (["--map", "id=Dron"], "alloc: --map: id=Dron: no table has a column 'Dron'"),
        (["--map", "ability"], "alloc: --map: must be NAME=VALUE, got 'ability'"),
        (["--map", "ability=Paylod"], "alloc: agents.csv: there is no column 'Paylod' (did you mean 'Payload'?)"),
        (["--units", "speed=kmh"], "alloc: --units: there is no quantity 'speed'"),
        (["--distances", "none.csv"], "alloc: none.csv: there is no such file; check the path"),
        (["--decimal", "dot"], "alloc: --decimal"),
    ],
)
def test_bad_options_are_one_line(alloc, options, line):
    """Invalid options give one line with the option or the file and exit code 2, and nothing is written."""
    ran = run(alloc, *options, "--output", "fleet.json")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(line)
    assert ran.err.count("\n") == 1
    assert not Path("fleet.json").exists()


@pytest.mark.usefixtures("tables")
def test_tables_are_not_overwritten(alloc):
    """The output must not be one of the tables."""
    ran = run(alloc, "--output", "agents.csv")
    assert ran.code == 2
    assert Path("agents.csv").read_text() == AGENTS


@pytest.mark.usefixtures("tables")
def test_unsupported_formats_name_supported_ones(alloc):
    """Unsupported spreadsheet formats are refused with the supported ones."""
    Path("fleet.ods").write_bytes(b"PK")
    ran = alloc("import", "--agents", "fleet.ods", "--tasks", "tasks.csv", "--output", "fleet.json")
    assert (ran.code, ran.err) == (2, "alloc: fleet.ods: tables cannot be read from .ods; save it as .xlsx or .csv\n")


@pytest.mark.usefixtures("tables")
def test_missing_openpyxl_is_named(alloc, monkeypatch):
    """Without openpyxl, a workbook is refused with the command that installs it."""
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    Path("fleet.xlsx").write_bytes(b"PK")
    ran = alloc("import", "--agents", "fleet.xlsx:Drones", "--tasks", "tasks.csv", "--output", "fleet.json")
    assert ran.code == 2
    assert ran.err == (
        "alloc: fleet.xlsx:Drones: needs openpyxl; install it with: pip install 'alloc-mrta[tables]',"
        " or save the sheet as .csv\n"
    )
