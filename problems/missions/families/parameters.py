"""Parameters of generated missions."""

import math
from dataclasses import dataclass

from alloc.problems.arguments import choice, real, whole
from alloc.problems.vocabulary import Knowledge, MissionFamily

MAX_SIZE = 1_000_000


@dataclass(frozen=True)
class MissionParameters:
    """Parameters of `random_mission`; missions are in the unit square.

    Attributes
    ----------
    family : MissionFamily or str
        What makes the mission hard. ``steady``: half of the tasks are there from the start, the others appear one by
        one, as in all families except the paper's. ``waves``: they appear in three waves. ``hot-spots``: around three
        places, one after the other. ``failures``: a fifth of the agents fail. ``recharging``: a fifth of the agents
        join late, a fifth are recalled for a while, and small batteries are recharged. ``growth``: tasks grow until an
        agent works there. ``deadlines``: most tasks have one. ``silence``: the radio of some agents and of a region
        fails for a while. ``paper-1`` to ``paper-4``: a scenario of the paper, in which 30 % of the tasks emerge and
        20 % of the agents fail.
    agents, tasks : int or None
        None for 20 and 40, or for the sizes of the paper's scenario, which cannot be changed.
    knowledge : Knowledge or str
        ``local``, or ``full``.
    radius, sensing : float
        Radio radius and sensing radius.
    loss : float
        Probability that a message is lost.

    Raises
    ------
    InputError
        If a value is out of range; the error's ``place`` is the field.
    """

    family: MissionFamily | str = MissionFamily.STEADY
    agents: int | None = None
    tasks: int | None = None
    knowledge: Knowledge | str = Knowledge.LOCAL
    radius: float = 0.3
    sensing: float = 0.3
    loss: float = 0.2

    def __post_init__(self) -> None:
        object.__setattr__(self, "family", choice(MissionFamily, self.family, "family"))
        object.__setattr__(self, "knowledge", choice(Knowledge, self.knowledge, "knowledge"))
        for name in ("agents", "tasks"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, whole(getattr(self, name), name, 1, MAX_SIZE))
        for name in ("radius", "sensing"):
            if getattr(self, name) != math.inf:
                real(getattr(self, name), name)
        real(self.loss, "loss", 0, 1)
