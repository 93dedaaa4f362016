"""A mission as a sequence of decisions of agents, with views and rewards."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.agenda import Wanted
from alloc.problems.missions.simulation.measures import DecisionTimes, lower_bound, measured
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import AgentStatus, MissionState, Order, TaskStatus
from alloc.problems.vocabulary import Knowledge

Source = Sequence[Mission] | Callable[[np.random.Generator], Mission]
"""Missions to sample from, or a function that makes one with a generator; all of the same size."""

Info = dict[str, float | int | bool]


@dataclass(frozen=True)
class Weights:
    """Weights in the reward.

    Attributes
    ----------
    waiting : float
        Weight of the waiting hours of tasks, by priority, relative to a lower bound on the mission time.
    energy : float
        Weight of the energy of flights, relative to one flight across the area per agent.
    """

    waiting: float = 0.5
    energy: float = 0.0


def sizes_of(source: Source) -> tuple[int, int]:
    """Return the numbers of agents and tasks; if `source` is a function, those of its first mission.

    Raises
    ------
    InputError
        If there are no missions, or they differ in size.
    """
    missions = [source(np.random.default_rng(0))] if callable(source) else source
    found = {(mission.instance.n, mission.instance.m) for mission in missions}
    if len(found) != 1:
        raise InputError(f"an environment needs missions of equal size, got {sorted(found) or 'none'}", "missions")
    return found.pop()


def draw(source: Source, sizes: tuple[int, int], rng: np.random.Generator) -> Mission:
    """Return a random mission.

    Raises
    ------
    InputError
        If it does not have the expected size.
    """
    mission = source(rng) if callable(source) else source[int(rng.integers(len(source)))]
    size = (mission.instance.n, mission.instance.m)
    if size != sizes:
        raise InputError(f"has {size[0]} agents and {size[1]} tasks, not {sizes[0]} and {sizes[1]}", mission.name)
    return mission


class Decisions:
    """A simulation that pauses whenever a free agent has to decide.

    Agents share all their knowledge whenever they can communicate.

    Parameters
    ----------
    mission : Mission
    knowledge : {"full", "local"}, optional
        By default that of the mission.
    seed : int
        Seed of the radio.
    switching : bool
        Whether agents that fly or work decide as well.
    weights : Weights

    Attributes
    ----------
    mission : Mission
    queue : list of int
        Numbers of the agents that have to decide now, in order; empty once the mission is over.
    """

    def __init__(
        self, mission: Mission, knowledge: Knowledge | str | None, seed: int, *, switching: bool, weights: Weights
    ) -> None:
        self.mission = mission
        self.queue: list[int] = []
        self._simulation = Simulation(mission, knowledge, seed)
        self._switching, self._weights = switching, weights
        instance = mission.instance
        self._priority = float(instance.priority.sum()) or 1.0
        self._hours = lower_bound(mission) or mission.end
        self._energy = float((instance.agent_energy_per_distance * mission.longest_flight).sum()) or math.inf
        self._advance()
        self._value = self._value_so_far()

    @property
    def state(self) -> MissionState:
        """The true state."""
        return self._simulation.state

    def view(self, agent: int) -> View:
        """Return what an agent knows now."""
        return self._simulation.view(self.mission.instance.agent_ids[agent])

    def decide(self, order: Order | None) -> float:
        """Give an order to the first agent in the queue, None for its last one, and advance to the next decision.

        Returns
        -------
        float
            The common reward since the last decision.
        """
        if order is not None:
            self._simulation.order(self.mission.instance.agent_ids[self.queue[0]], order)
        del self.queue[0]
        if not self.queue:
            self._advance()
        before, self._value = self._value, self._value_so_far()
        return self._value - before

    def figures(self) -> Info:
        """Return hour, tasks done and energy so far; at the end also the measures of the mission."""
        state = self._simulation.state
        done = sum(task.status is TaskStatus.DONE for task in state.tasks)
        found: Info = {
            "hour": state.hour,
            "tasks_done": done,
            "energy": math.fsum(agent.energy for agent in state.agents),
        }
        if not self.queue:
            result = measured(self._simulation, "environment", 0, DecisionTimes())
            found["is_done"] = result.is_done
            found["mission_time"] = math.inf if result.mission_time is None else result.mission_time
            found["priority_done_share"] = result.priority_done_share
            found["switches"], found["messages"] = result.switches, result.messages
        return found

    def _advance(self) -> None:
        """Advance the simulation to the next decision or to the end."""
        simulation = self._simulation
        while not self.queue and (request := simulation.advance()) is not None:
            if request.wanted is Wanted.ORDERS:
                self.queue = [number for number in map(self._number, request.agents) if self._is_free(number)]
            elif simulation.knowledge is Knowledge.LOCAL:
                for name in request.agents:
                    simulation.send(name, simulation.view(name, is_glance=True).message())

    def _number(self, name: str) -> int:
        return self.mission.instance.agent_index[name]

    def _is_free(self, agent: int) -> bool:
        return self._switching or self._simulation.state.agents[agent].status is AgentStatus.IDLE

    def _value_so_far(self) -> float:
        """Return the sum of all rewards so far: priority done, minus weighted waiting hours and weighted energy."""
        state, weights = self._simulation.state, self._weights
        done = waited = 0.0
        for task in state.tasks:
            done += task.facts.priority * (task.status is TaskStatus.DONE)
            waited += task.facts.priority * max(0.0, min(task.closed, state.hour) - task.facts.appears)
        energy = math.fsum(agent.energy for agent in state.agents) / self._energy
        return (done - weights.waiting * waited / self._hours) / self._priority - weights.energy * energy
