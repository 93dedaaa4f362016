"""The words of the problem that need no numpy: what is optimised, how instances are made, and how the game goes."""

from enum import StrEnum

IDLE = -1
"""The task index of an agent without a task."""

EUCLIDEAN, MANHATTAN, GEOGRAPHIC = METRICS = ("euclidean", "manhattan", "geographic")
"""How far two places are apart: (1) of the paper, the sum over the axes, or along the surface of the earth."""


class Objective(StrEnum):
    """What is optimised, in this order, after the number of unserved tasks."""

    MAKESPAN = "makespan"
    MAKESPAN_ENERGY = "makespan-energy"
    MAKESPAN_MOVES = "makespan-moves"


OBJECTIVES = (Objective.MAKESPAN, Objective.MAKESPAN_ENERGY)
"""What methods optimise; moves are to them a kind of energy, see `replanning`."""


class Distribution(StrEnum):
    """How abilities or workloads spread."""

    EQUAL = "equal"
    UNIFORM = "uniform"
    LOGNORMAL = "lognormal"
    PARETO = "pareto"
    DIRICHLET = "dirichlet"


class Sites(StrEnum):
    """How places lie in the world."""

    UNIFORM = "uniform"
    CLUSTERED = "clustered"


class Starts(StrEnum):
    """Where agents begin."""

    TASKS = "tasks"
    OWN = "own"
    DEPOTS = "depots"
    UNKNOWN = "unknown"


class TurnRule(StrEnum):
    """Which agents move in a step of the game."""

    BIDDING = "bidding"
    SIMULTANEOUS = "simultaneous"


class Reward(StrEnum):
    """What the reward of the game measures."""

    MAKESPAN = "makespan"
    COVERAGE = "coverage"


class ModelFormat(StrEnum):
    """Files of integer programmes."""

    LP = "lp"
    MPS = "mps"


class ModelKind(StrEnum):
    """What the variables of an integer programme stand for: classes of agents that are alike, or agents."""

    CLASS = "class"
    PLAIN = "plain"


class Knowledge(StrEnum):
    """What agents know in a mission: all that is so now, or what they sensed and heard."""

    FULL = "full"
    LOCAL = "local"


class ForeignFormat(StrEnum):
    """Files of others that are read as missions."""

    CFSTP = "cfstp"
    SPACE = "space"
    LONDON = "london"
    NEW_BRUNSWICK = "new-brunswick"


class MissionFamily(StrEnum):
    """What makes a generated mission hard."""

    STEADY = "steady"
    WAVES = "waves"
    HOT_SPOTS = "hot-spots"
    FAILURES = "failures"
    RECHARGING = "recharging"
    GROWTH = "growth"
    DEADLINES = "deadlines"
    SILENCE = "silence"
    PAPER_1 = "paper-1"
    PAPER_2 = "paper-2"
    PAPER_3 = "paper-3"
    PAPER_4 = "paper-4"
