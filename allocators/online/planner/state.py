"""The state of an open-ended mission, to which agents and tasks may be added."""

from dataclasses import replace

from alloc.allocators.online.planner.register import Register
from alloc.problems.errors import InputError
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
from alloc.problems.missions.simulation.state import AgentState, AgentStatus, MissionState, TaskState, TaskStatus

TO_DO = (TaskStatus.TO_COME, TaskStatus.OPEN)


class LiveState(MissionState):
    """The state of a mission to which agents and tasks may be added.

    Parameters
    ----------
    mission : Mission

    Attributes
    ----------
    agents : list of AgentState
        Those that have not failed.
    tasks : list of TaskState
        Those that are open or to come.
    all_agents, all_tasks : Register
        These, and the last ones that have failed or are closed.
    """

    def __init__(self, mission: Mission) -> None:
        super().__init__(mission)
        self.all_agents, self.all_tasks = Register("agent", self.agents), Register("task", self.tasks)
        self.agents, self.tasks = self.all_agents.lasting, self.all_tasks.lasting
        document = mission_to_document(mission)
        self._header = {name: document[name] for name in HEADER_FIELDS if name in document and name != "distances"}

    def agent(self, name: str | None) -> AgentState:
        """Return an agent by its id."""
        return self.all_agents.find(name)

    def task(self, name: str | None) -> TaskState:
        """Return a task by its id."""
        return self.all_tasks.find(name)

    def file_agent(self, agent: AgentState) -> None:
        """Update the register after a change of an agent's status."""
        self.all_agents.file(agent, is_over=agent.status is AgentStatus.FAILED)
        self.all_agents.forget()

    def file_task(self, task: TaskState) -> None:
        """Update the register after a change of a task's status.

        A closed task is not forgotten while an agent is on its way there.
        """
        self.all_tasks.file(task, is_over=task.status not in TO_DO)
        if self.all_tasks.is_full:
            goals = {agent.order.task for agent in self.agents}
            flights = (agent.flight for agent in self.agents)
            goals.update(flight.task.facts.id for flight in flights if flight is not None and flight.task is not None)
            self.all_tasks.forget(goals)

    def admit(self, event: Row) -> None:
        """Add the agent or the task defined in an event, as one that is still to come.

        Parameters
        ----------
        event : dict
            As in a mission file.

        Raises
        ------
        InputError
            If its id is taken, or a field breaks the rules of the format. Nothing is added then.
        """
        kind = "agent" if event["event"] == EventKind.AGENT_JOINS else "task"
        row = event[kind]
        assert isinstance(row, dict)
        name = str(row["id"])
        (self.all_agents if kind == "agent" else self.all_tasks).require_new(name)
        new = MissionState(self._alone(event, kind, row))
        if kind == "agent":
            self._add_agent(new.agents[-1], row)
        else:
            self._add_task(new.tasks[-1])

    def _alone(self, event: Row, kind: str, row: Row) -> Mission:
        """Return a minimal valid mission with the new agent or task, and everything that it refers to."""
        other = {"id": f"other than {row['id']}", "position": row.get("position")}
        agents: list[Row] = []
        tasks: list[Row] = []
        if kind == "task":
            agents.append({**other, "ability": 1})
        else:
            listed = row.get("tasks")
            named = [*(listed if isinstance(listed, list) else ()), row.get("start_task")]
            known = {str(name): None for name in named if str(name) in self.all_tasks}
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
        agent.index, agent.facts, agent.place = self.all_agents.ever, replace(agent.facts, start=place), place
        self.all_agents.add(agent)

    def _add_task(self, task: TaskState) -> None:
        task.index = self.all_tasks.ever
        place = Place(task.facts.place.position, (self.mission.instance.n + task.index,))
        task.facts = replace(task.facts, place=place)
        self.all_tasks.add(task)
