"""The contract of a policy: what it may know, and what it answers when it is asked for orders."""

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
    """A policy answered what is no order: a defect of the policy."""


@dataclass(frozen=True, kw_only=True)
class PolicyInfo:
    """What is known of a policy before it is loaded.

    Attributes
    ----------
    name : str
        As in ``--policy``; lower-case letters, digits and hyphens.
    summary : str
        One line.
    central : bool
        Whether it decides for all agents at once, which needs full knowledge; else each agent decides for itself.
    clairvoyant : bool
        Whether it is told all that is to come: no policy for use, but what others are measured against.
    requires : tuple of str
        Modules that must be installed.
    options : tuple of str
        Options that its constructor takes besides its parameters.
    citation : str
        Where it comes from.
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
    """What is known before a mission begins.

    Attributes
    ----------
    agent : str or None
        Who will decide; None for who leads all agents.
    knowledge : Knowledge
    seed : tuple of int
        Of this agent's random numbers.
    deadline_s : float or None
        Seconds for each decision; None for no limit.
    end : float
        Hour at which the mission ends at the latest.
    sensing : float
        Distance up to which an agent sees; ``inf`` for everything.
    radio : Radio
    area : tuple of two positions
        Least and largest coordinates of all places in the mission.
    pace : Pace or None
        Between what the work of groups is drawn; not what is drawn.
    mission : Mission or None
        All that will happen, for a policy that is `clairvoyant`; None for all others.
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
        """Return what an agent, or who leads all, is told of a mission; all of it, if the policy is clairvoyant."""
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
        """Return a source of random numbers of its own."""
        return np.random.default_rng(self.seed)


class AgentDecider(ABC):
    """Decides for one agent in one mission: it is told what the agent knows, and nothing else."""

    @abstractmethod
    def decide(self, view: View) -> Order | None:
        """Return where the agent is to go; None for where its last order says.

        Parameters
        ----------
        view : View
            What the agent knows now.

        Returns
        -------
        Order or None
        """

    def message(self, view: View) -> Message | None:
        """Return what the agent sends now; all that it knows by default, None for nothing.

        Parameters
        ----------
        view : View
            What the agent knows now; messages that came stay in ``heard`` until it decides.

        Returns
        -------
        Message or None
        """
        return view.message()


class FleetDecider(ABC):
    """Decides for all agents in one mission, knowing all that is so now."""

    @abstractmethod
    def decide(self, view: View) -> Mapping[str, Order]:
        """Return where agents are to go, by their ids; the last orders of all others stand.

        Parameters
        ----------
        view : View

        Returns
        -------
        mapping of str to Order
        """


class TurnsDecider(ABC):
    """Decides for agents in turn, as each would for itself, where everything is known to all."""

    @abstractmethod
    def turns(self, view: View, names: Sequence[str]) -> Iterator[tuple[str, Order | None]]:
        """Return where agents are to go, one after the other; each knows what those before it were told.

        Parameters
        ----------
        view : View
            Of nobody in particular.
        names : sequence of str
            Ids of the agents, in their turn. Whoever asks may stop before the last.

        Yields
        ------
        name : str
        order : Order or None
            None for where its last order says.
        """


class Policy(Parameterised):
    """A policy, loaded and ready; one object serves many missions.

    Subclasses set `info`, and `parameters_type` if they have parameters, as allocators do; `begin` changes no
    attribute.

    Parameters
    ----------
    parameters : parameters_type, optional
        Its parameters; the defaults if None.
    **settings
        Single parameters by name.

    Attributes
    ----------
    info : PolicyInfo
        Name and needs.
    parameters_type : type or None
        Frozen dataclass of the parameters, with a default for each; None for a policy without parameters.

    Raises
    ------
    InputError
        If there is no such parameter, or its value is wrong; its place is the name of the parameter.
    """

    info: ClassVar[PolicyInfo]

    @classmethod
    def _title(cls) -> str:
        return f"policy {cls.info.name!r}"

    @abstractmethod
    def begin(self, briefing: Briefing) -> AgentDecider | FleetDecider:
        """Return who decides in a mission: for one agent, or for all if the policy is central.

        Parameters
        ----------
        briefing : Briefing

        Returns
        -------
        AgentDecider or FleetDecider
        """

    def begin_turns(self, briefing: Briefing) -> TurnsDecider | None:
        """Return who decides for agents in turn, faster than one by one; None where nobody does.

        Parameters
        ----------
        briefing : Briefing
            Of who leads all agents.

        Returns
        -------
        TurnsDecider or None
        """
        return None
