"""Agents and tasks of a mission that has no end yet: more of both may come than it began with."""

from dataclasses import replace

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError, nearest
from alloc.problems.formats.json_columns import Row
from alloc.problems.missions.events import EventKind
from alloc.problems.missions.files.document import (
    HEADER_FIELDS,
    MISSION_FORMAT,
    mission_from_document,
    mission_to_document,
)
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.state import AgentState, MissionState, TaskState


class LiveState(MissionState):
    """The state of a mission to which agents and tasks may be added.

    Parameters
    ----------
    mission : Mission

    Attributes
    ----------
    arrivals : list of dict
        The events that brought agents and tasks, each as a whole, in their order.
    """

    def __init__(self, mission: Mission) -> None:
        super().__init__(mission)
        self.arrivals: list[Row] = []
        self._agent_index = dict(mission.instance.agent_index)
        self._task_index = dict(mission.instance.task_index)
        document = mission_to_document(mission)
        self._header = {name: document[name] for name in HEADER_FIELDS if name in document and name != "distances"}

    def agent(self, name: str | None) -> AgentState:
        """Return an agent by its id."""
        if name not in self._agent_index:
            raise InputError(f"there is no agent {shown(name)}{nearest(str(name), tuple(self._agent_index))}", "agent")
        return self.agents[self._agent_index[name]]

    def task(self, name: str | None) -> TaskState:
        """Return a task by its id."""
        if name not in self._task_index:
            raise InputError(f"there is no task {shown(name)}{nearest(str(name), tuple(self._task_index))}", "task")
        return self.tasks[self._task_index[name]]

    def admit(self, event: Row) -> None:
        """Add the agent or the task that comes with an event, as one that is still to come.

        Parameters
        ----------
        event : dict
            As in a file of a mission.

        Raises
        ------
        InputError
            If its id is taken, or a field breaks the rules of the format; then nothing is added.
        """
        kind = "agent" if event["event"] == EventKind.AGENT_JOINS else "task"
        row = event[kind]
        assert isinstance(row, dict)
        name = str(row["id"])
        if name in (self._agent_index if kind == "agent" else self._task_index):
            raise InputError(f"there is {kind} {shown(name)} already", f"{kind}.id")
        new = MissionState(self._alone(event, kind, row))
        if kind == "agent":
            self._add_agent(new.agents[-1], row)
        else:
            self._add_task(new.tasks[-1])
        self.arrivals.append(event)

    def _alone(self, event: Row, kind: str, row: Row) -> Mission:
        """Return a mission of what is new, beside what it names and what a mission needs."""
        other = {"id": f"other than {row['id']}", "position": row.get("position")}
        agents: list[Row] = []
        tasks: list[Row] = []
        if kind == "task":
            agents.append({**other, "ability": 1})
        else:
            listed = row.get("tasks")
            named = [*(listed if isinstance(listed, list) else ()), row.get("start_task")]
            known = {str(name): None for name in named if str(name) in self._task_index}
            tasks = [{"id": one, "workload": 1, "position": self._position(one)} for one in known]
            tasks = tasks or [{**other, "workload": 1}]
        document = {**self._header, "format": MISSION_FORMAT, "agents": agents, "tasks": tasks, "events": [event]}
        try:
            return mission_from_document(document)
        except InputError as error:
            raise InputError(error.message, error.place.removeprefix("events[0].")) from error

    def _position(self, task: str) -> list[float] | None:
        position = self.task(task).facts.place.position
        return None if position is None else list(position)

    def _add_agent(self, agent: AgentState, row: Row) -> None:
        start = row.get("start_task")
        place = Place(agent.facts.start.position) if start is None else self.task(str(start)).facts.place
        agent.index, agent.facts, agent.place = len(self.agents), replace(agent.facts, start=place), place
        self.agents.append(agent)
        self._agent_index[agent.facts.id] = agent.index

    def _add_task(self, task: TaskState) -> None:
        task.index = len(self.tasks)
        place = Place(task.facts.place.position, (self.mission.instance.n + task.index,))
        task.facts = replace(task.facts, place=place)
        self.tasks.append(task)
        self._task_index[task.facts.id] = task.index
