"""The radio channel: who receives a message, given losses, bursts and silences."""

import math

import numpy as np

from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.fields import BoolArray
from alloc.problems.missions.chance import BURST, LOSS, uniform
from alloc.problems.missions.events import Event
from alloc.problems.missions.simulation.motion import place_at
from alloc.problems.missions.simulation.state import ACTIVE, AgentState, MissionState


class Channel:
    """Radio links between all agents, and silences.

    Losses depend only on the seeds, the two agents and the number of the message, and are the same for all policies.

    Parameters
    ----------
    state : MissionState
    seed : int
        Seed of the run, combined with that of the mission.
    """

    def __init__(self, state: MissionState, seed: int) -> None:
        self._state, self._radio = state, state.mission.radio
        self._seeds = state.mission.seed, seed
        self._silences: list[Event] = []
        self._agents: list[AgentState] = []
        self._row: dict[int, int] = {}
        self._near: BoolArray = np.zeros((0, 0), dtype=np.bool_)
        self._links: dict[tuple[int, int], tuple[int, bool]] = {}

    def silence(self, event: Event) -> None:
        """Silence an agent or a region until the hour given by the event."""
        self._silences.append(event)

    def is_silent(self, agent: AgentState) -> bool:
        """Whether an agent can neither send nor receive now."""
        return any(self._concerns(event, agent) for event in self._silences)

    def _concerns(self, event: Event, agent: AgentState) -> bool:
        assert event.until is not None
        if self._state.hour >= event.until:
            return False
        if event.agent is not None:
            return agent.facts.id == event.agent
        assert event.center is not None
        assert event.radius is not None
        x, y, z = event.center
        place = place_at(self._state, agent)
        return self._state.distances.by_metric(place.position, (x, y, z)) <= event.radius + TOLERANCE

    def open(self) -> None:
        """Update which agents are in range of each other, before the messages of an hour are sent."""
        self._agents = [agent for agent in self._state.agents if agent.status in ACTIVE]
        self._row = {agent.index: row for row, agent in enumerate(self._agents)}
        places = [place_at(self._state, agent).position for agent in self._agents]
        self._near = self._state.distances.table(places, places) <= self._radio.radius + TOLERANCE

    def hearers(self, sender: AgentState, number: int) -> list[AgentState]:
        """Return the receivers of message `number` of an agent that sends now.

        They must be in the mission and within the radius when it is sent. Whether they can receive it when it arrives
        is decided by `is_silent`.
        """
        near = [self._agents[row] for row in np.flatnonzero(self._near[self._row[sender.index]]).tolist()]
        return [agent for agent in near if agent is not sender and not self._is_lost(sender.index, agent.index, number)]

    def _is_lost(self, sender: int, hearer: int, number: int) -> bool:
        radio = self._radio
        if radio.loss and uniform(LOSS, *self._seeds, sender, hearer, number) < radio.loss:
            return True
        if radio.burst is None:
            return False
        bad = self._is_bad(sender, hearer, number)
        loss = radio.burst.loss_bad if bad else radio.burst.loss_good
        return uniform(LOSS, *self._seeds, sender, hearer, number, 1) < loss

    def _is_bad(self, sender: int, hearer: int, number: int) -> bool:
        """Whether a link is bad at a message: a Markov chain over all message numbers up to it, sent or not."""
        burst = self._radio.burst
        assert burst is not None
        last, bad = self._links.get((sender, hearer), (-1, False))
        for step in range(last + 1, number + 1):
            hours = self._radio.period if step else math.inf
            bad = uniform(BURST, *self._seeds, sender, hearer, step) < burst.probability_bad(bad, hours)
        self._links[sender, hearer] = number, bad
        return bad
