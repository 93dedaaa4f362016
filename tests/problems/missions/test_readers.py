"""Import of third-party files as missions."""

import sys
from datetime import date

import numpy as np
import pytest

from alloc.problems import InputError, MissingPackageError, RecordOptions, import_mission
from alloc.problems.missions.files.document import mission_from_document, mission_to_document

CALLS = """incident_number,date_time_of_call,pump_hours_total,easting_rounded,northing_rounded,stn_ground_name
1,01/02/2020 12:00,2,530000,180000,North
2,02/02/2020 00:00,NULL,532000,181000,North
2,03/02/2020 18:00,1,528000,177000,South
4,04/02/2020 10:00,1,NULL,NULL,South
"""
FIRES = """x,y,year,dis.date,dis.julian,fnl.size
100,200,1999,1999-05-03,123,4
300,100,1999,NA,124,0
"""
PRINTED = """some other line
task[  1] at (  9,   2)
task[  0] at (  3,  12)
agent[  0] starting at (  5,  10)
task[  0] has demands [60, 18]
task[  1] has demands [40, 5]
"""
CONFIG = """
agents:
  quantity: 3
  locations: {x_min: -10, x_max: 10, y_min: 100, y_max: 200}
  max_speed: 0.5
  work_rate: 2
  communication_radius: 0
  situation_awareness_radius: 30
tasks:
  quantity: 2
  locations: {x_min: 0, x_max: 1, y_min: 0, y_max: 1}
  amounts: {min: 5, max: 6}
  dynamic_task_generation: {enabled: True, interval_seconds: 100, max_generations: 2, tasks_per_generation: 3}
simulation: {sampling_freq: 4.0, max_simulation_time: 900}
"""


@pytest.fixture
def file(tmp_path):
    """Writes a text to a file, and returns its path."""

    def write(text, name="file.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def test_calls_become_tasks(file):
    """Places in km, hours since the first call, pump hours or 1; calls without a place are left out and reported."""
    told = []
    mission = import_mission("london", file(CALLS), RecordOptions(agents=3, compress=2), report=told.append)
    assert mission.instance.task_ids == ("1", "2", "2-2")
    assert mission.appears.tolist() == [0, 6, 27]
    assert mission.instance.workload.tolist() == [2, 1, 1]
    assert mission.instance.task_position[0].tolist() == [530, 180, 0]
    assert mission.instance.agent_position[:, :2].tolist() == [[531, 180.5], [528, 177], [531, 180.5]]
    assert mission.instance.speed.tolist() == [30, 30, 30]
    assert told == ["1 call without a place or an hour left out", "1 call without pump hours set to 1"]
    assert mission_to_document(mission_from_document(mission_to_document(mission))) == mission_to_document(mission)


def test_days_can_be_selected(file):
    """Hours count from the start of the first selected day; the last day is included."""
    wanted = RecordOptions(first=date(2020, 2, 2), last=date(2020, 2, 3))
    mission = import_mission("london", file(CALLS), wanted)
    assert mission.appears.tolist() == [0, 42]
    with pytest.raises(InputError, match="no record in the selected days"):
        import_mission("london", file(CALLS), RecordOptions(first=date(2021, 1, 1)))


def test_agents_are_read_from_the_fleet(file):
    """Pumping appliances in service are the agents, up to the requested number."""
    fleet = file(
        "Fleet No,Operational Status,Type of Vehicle\n"
        "p1,ACTIVE,Pumping Appliance\np2,RESERVE,Pumping Appliance\nc3,ACTIVE,Car\np4,ACTIVE,Pumping Appliance\n",
        "fleet.csv",
    )
    assert import_mission("london", file(CALLS), RecordOptions(fleet=fleet)).instance.agent_ids == ("p1", "p4")
    one = import_mission("london", file(CALLS), RecordOptions(fleet=fleet, agents=1))
    assert one.instance.agent_ids == ("p1",)
    with pytest.raises(InputError, match="at most 2"):
        import_mission("london", file(CALLS), RecordOptions(fleet=fleet, agents=3))


def test_fires_become_tasks(file):
    """Places in units of 0.403716 km, days by date or by number, sizes of at least 0.1 ha."""
    mission = import_mission("new-brunswick", file(FIRES), RecordOptions(agents=2, ability=0.5, speed=80))
    assert mission.appears.tolist() == [0, 24]
    assert mission.instance.workload.tolist() == [4, 0.1]
    assert mission.instance.task_position[0, :2].tolist() == pytest.approx([40.3716, 80.7432])
    assert (mission.instance.ability.tolist(), mission.instance.speed.tolist()) == ([0.5, 0.5], [80, 80])
    assert {tuple(place) for place in mission.instance.agent_position} <= set(
        map(tuple, mission.instance.task_position)
    )


def test_printed_cfstp_is_read(file):
    """Tasks are in the order of their numbers, distances Manhattan, and coalitions work at a pace of 1 to 2."""
    mission = import_mission("cfstp", file(PRINTED))
    assert mission.instance.task_position[:, :2].tolist() == [[3, 12], [9, 2]]
    assert (mission.instance.workload.tolist(), mission.deadline.tolist()) == ([18, 5], [60, 40])
    assert (mission.instance.metric, mission.pace.low, mission.pace.high) == ("manhattan", 1, 2)
    assert mission.instance.agent_position[:, :2].tolist() == [[5, 10]]


def test_space_configurations_are_read(file):
    """Places and workloads are within bounds, later tasks come in waves, and a radius of 0 means unlimited."""
    mission = import_mission("space", file(CONFIG, "c.yaml"), seed=4)
    instance = mission.instance
    assert (instance.n, instance.m) == (3, 8)
    assert mission.appears.tolist() == [0, 0, 100, 100, 100, 200, 200, 200]
    assert instance.ability.tolist() == [8, 8, 8]  # 2 a step, 4 steps a second
    assert ((instance.workload >= 5) & (instance.workload <= 6)).all()
    assert (np.abs(instance.agent_position[:, 0]) <= 10).all()
    assert (instance.agent_position[:, 1] >= 100).all()
    assert (mission.radio.radius, mission.sensing, mission.horizon) == (np.inf, 30, 900)
    again = import_mission("space", file(CONFIG, "c.yaml"), seed=4)
    other = import_mission("space", file(CONFIG, "c.yaml"), seed=5)
    assert mission_to_document(again) == mission_to_document(mission) != mission_to_document(other)


def test_space_needs_yaml(file, monkeypatch):
    """Without PyYAML, the error says what to install."""
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(MissingPackageError, match=r"alloc-mrta\[tables\]"):
        import_mission("space", file(CONFIG, "c.yaml"))


@pytest.mark.parametrize(
    ("kind", "text", "told"),
    [
        ("london", "a,b\n1,2\n", "line 1: has no column 'IncidentNumber'"),
        ("london", CALLS.replace("530000", "east"), "line 2: Easting_rounded: must be a number, got 'east'"),
        ("london", CALLS.replace("01/02/2020", "soon"), "line 2: DateTimeOfCall: must be a date"),
        ("london", CALLS.replace(",2,530000", ",-2,530000"), "line 2: PumpHoursTotal: must be >= 0"),
        ("new-brunswick", FIRES.replace(",124,", ",999,"), "line 3: dis.julian: must be a day of a year"),
        ("cfstp", "nothing", "is not a CFSTP instance"),
        ("cfstp", PRINTED.replace("task[  1] has", "thing"), "task[1]: is missing"),
        ("cfstp", PRINTED.replace("[40, 5]", "[0, 5]"), "deadline: must be after the hour"),
        ("space", "agents: [", "line 1"),
        ("space", "agents: {quantity: no}", "agents.quantity: is false, but must be a whole number >= 1"),
        ("space", CONFIG.replace("max_speed: 0.5", "max_speed: 0"), "agents.max_speed: is 0, but must be a number > 0"),
        ("space", CONFIG.replace("max: 6", "max: 4"), "tasks.amounts.max: must be at least 5"),
        ("space", CONFIG.replace("y_min: 100", "y_min: .nan"), "agents.locations.y_min: is NaN, but must be a number"),
    ],
)
def test_faults_name_file_and_place(file, kind, text, told):
    """A fault in a file is a one-line error with the file and the place in it."""
    path = file(text)
    with pytest.raises(InputError) as caught:
        import_mission(kind, path)
    assert str(caught.value).startswith(f"{path}: ")
    assert told in str(caught.value)


def test_wrong_options_are_refused(file):
    """Options that a format does not take or that are out of range are errors that name them."""
    for options, kind, told in (
        (RecordOptions(), "space", "options: are for records, not for space"),
        (RecordOptions(fleet="x.csv"), "new-brunswick", "fleet: is for london"),
    ):
        with pytest.raises(InputError, match=told):
            import_mission(kind, file(FIRES), options)
    for values, place in (({"compress": 0}, "compress"), ({"agents": 0}, "agents"), ({"speed": -1}, "speed")):
        with pytest.raises(InputError) as caught:
            RecordOptions(**values)
        assert caught.value.place == place
    with pytest.raises(InputError, match="must not be before"):
        RecordOptions(first=date(2020, 1, 2), last=date(2020, 1, 1))
