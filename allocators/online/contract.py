"""The policy contract: what a policy may know, and the orders that it returns."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import ClassVar

import numpy as np

from alloc.allocators.contract.parameters import Parameterised
from alloc.problems.errors import AllocError
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Pace, Radio
from alloc.problems.missions.simulation.reports import Message, View
from alloc.problems.missions.simulation.state import Order
from alloc.problems.vocabulary import Knowledge


class PolicyError(AllocError):
    """A policy returned something that is not an order: a defect of the policy."""


@dataclass(frozen=True, kw_only=True)
class PolicyInfo:
    """Description of a policy, available before it is loaded.

    Attributes
    ----------
    name : str
        As in ``--policy``; lower-case letters, digits and hyphens.
    summary : str
        One line.
    central : bool
        Whether it decides for all agents at once, which needs full knowledge; otherwise each agent decides for itself.
    clairvoyant : bool
        Whether it knows the future: a reference for other policies, not a policy for use.
    requires : tuple of str
        Modules that must be installed.
    options : tuple of str
        Options that its constructor takes besides its parameters.
    citation : str
        Publication that it is based on.
    """

    name: str
    summary: str
    central: bool = False
    clairvoyant: bool = False
    requires: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    citation: str = ""

    @property
    def missing(self) -> tuple[str, ...]:
        """Required modules that are not installed."""
        return tuple(module for module in self.requires if find_spec(module) is None)


@dataclass(frozen=True)
class Briefing:
    """What a decider knows before a mission begins.

    Attributes
    ----------
    agent : str or None
        Id of the agent that decides; None for a central policy.
    knowledge : Knowledge
    seed : tuple of int
        Seed of the decider's random numbers.
    deadline_s : float or None
        Time limit of each decision in seconds; None for no limit.
    end : float
        Hour at which the mission ends at the latest.
    sensing : float
        Sensing radius; ``inf`` if agents see everything.
    radio : Radio
    area : tuple of two positions
        Smallest and largest coordinates of all places in the mission.
    pace : Pace or None
        Range from which the factors on the work of groups are drawn, but not the factors themselves.
    mission : Mission or None
        The whole mission, future events included, for a `clairvoyant` policy; None for all others.
    """

    agent: str | None
    knowledge: Knowledge
    seed: tuple[int, ...]
    deadline_s: float | None
    end: float
    sensing: float
    radio: Radio
    area: tuple[tuple[float, ...], tuple[float, ...]]
    pace: Pace | None = None
    mission: Mission | None = None

    @classmethod
    def of(
        cls,
        mission: Mission,
        knowledge: Knowledge,
        seed: int,
        deadline_s: float | None,
        agent: str | None,
        *,
        clairvoyant: bool = False,
    ) -> "Briefing":
        """Return the briefing of an agent, or of a central policy if `agent` is None."""
        number = 0 if agent is None else mission.instance.agent_index[agent] + 1
        return cls(
            agent=agent,
            knowledge=knowledge,
            seed=(seed, number),
            deadline_s=deadline_s,
            end=mission.end,
            sensing=mission.sensing,
            radio=mission.radio,
            area=mission.area,
            pace=mission.pace,
            mission=mission if clairvoyant else None,
        )

    def generator(self) -> np.random.Generator:
        """Return a new random generator with this seed."""
        return np.random.default_rng(self.seed)


class AgentDecider(ABC):
    """Decides for one agent in one mission, from what this agent knows and nothing else."""

    @abstractmethod
    def decide(self, view: View) -> Order | None:
        """Return the agent's new order; None to keep the last one.

        Parameters
        ----------
        view : View
            What the agent knows now.

        Returns
        -------
        Order or None
        """

    def message(self, view: View) -> Message | None:
        """Return the message that the agent sends now: by default all that it knows; None to send nothing.

        Parameters
        ----------
        view : View
            What the agent knows now; received messages stay in ``heard`` until its next decision.

        Returns
        -------
        Message or None
        """
        return view.message()


class FleetDecider(ABC):
    """Decides for all agents in one mission, with full knowledge of its present state."""

    @abstractmethod
    def decide(self, view: View) -> Mapping[str, Order]:
        """Return new orders by agent id; agents without one keep their last order.

        Parameters
        ----------
        view : View

        Returns
        -------
        mapping of str to Order
        """


class TurnsDecider(ABC):
    """Decides for agents one after another, as each would for itself, under full knowledge."""

    @abstractmethod
    def turns(self, view: View, names: Sequence[str]) -> Iterator[tuple[str, Order | None]]:
        """Yield the orders of agents one after another; each decision takes the orders before it into account.

        Parameters
        ----------
        view : View
            Not of a particular agent.
        names : sequence of str
            Ids of the agents in the order of their decisions. The caller may stop before the last.

        Yields
        ------
        name : str
        order : Order or None
            None to keep the last order.
        """


class Policy(Parameterised):
    """A policy, loaded and ready for use in any number of missions.

    Subclasses set `info`, and `parameters_type` if they have parameters, as allocators do; `begin` must not change
    attributes.

    Parameters
    ----------
    parameters : parameters_type, optional
        Parameters of the policy; the defaults if None.
    **settings
        Single parameters by name.

    Attributes
    ----------
    info : PolicyInfo
        Name, summary and requirements.
    parameters_type : type or None
        Frozen dataclass of the parameters, with a default for each; None for a policy without parameters.

    Raises
    ------
    InputError
        If a parameter is unknown or its value is invalid; the error's ``place`` is the name of the parameter.
    """

    info: ClassVar[PolicyInfo]

    @classmethod
    def _title(cls) -> str:
        return f"policy {cls.info.name!r}"

    @abstractmethod
    def begin(self, briefing: Briefing) -> AgentDecider | FleetDecider:
        """Return the decider of a mission: for one agent, or for all agents if the policy is central.

        Parameters
        ----------
        briefing : Briefing

        Returns
        -------
        AgentDecider or FleetDecider
        """

    def begin_turns(self, briefing: Briefing) -> TurnsDecider | None:
        """Return a decider for all agents in turn, faster than one decider for each; None if there is none.

        Parameters
        ----------
        briefing : Briefing
            As for a central policy.

        Returns
        -------
        TurnsDecider or None
        """
        return None
