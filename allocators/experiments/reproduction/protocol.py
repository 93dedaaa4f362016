"""Design of the experiments, including all that the paper leaves open; does not import torch."""

from collections.abc import Mapping
from dataclasses import dataclass, field

PAPER_METHODS = ("gappo", "a2c", "ppo", "dqn", "ddpg")
"""The five of the paper, in its order."""


@dataclass(frozen=True)
class Variant:
    """A method to train, and how it differs from that method as tuned.

    Attributes
    ----------
    method : str
    changes : mapping of str to object
        Hyperparameters that differ from `TUNED`.
    has_attention : bool
        Whether the network has attention.
    shares_network : bool
        Whether the members of a population share one.
    """

    method: str
    changes: Mapping[str, object] = field(default_factory=dict)
    has_attention: bool = True
    shares_network: bool = True


_POPULATION: Mapping[str, object] = {"genes": 3}

LEARNING: Mapping[str, Variant] = {
    "gappo": Variant("gappo", _POPULATION),
    "gappo-single": Variant("gappo", {"genes": 1}),
    **{name: Variant(name) for name in PAPER_METHODS[1:]},
}
"""Methods that are compared with each other, by their names in the rows; `gappo-single` is without a population."""

VARIANTS: Mapping[str, Variant] = {
    **LEARNING,
    "gappo-unshared": Variant("gappo", _POPULATION, shares_network=False),
    "gappo-no-evolution": Variant("gappo", {**_POPULATION, "breeding_interval": 0}),
    "gappo-linear-rate": Variant("gappo", {**_POPULATION, "target_kl": None}),
    "gappo-no-attention": Variant("gappo", _POPULATION, has_attention=False),
    "gappo-on-policy": Variant("gappo", {**_POPULATION, "buffer_size": 0}),
}
"""All that can be trained: `LEARNING`, and ablations of `gappo`."""

ABLATIONS: Mapping[str, tuple[str, str]] = {
    "gappo-unshared": (
        "sharing",
        "each member has its own network and step size; initial members, turns and replay buffer are the same",
    ),
    "gappo-single": ("genes", "one member, which is PPO with the adaptive rate and the replay buffer"),
    "gappo-no-evolution": (
        "genetic algorithm",
        "initial genes are kept, without selection, crossover and mutation; the policy is the first member's",
    ),
    "gappo-linear-rate": ("adaptive rate", "the step size decays linearly, as in `ppo`"),
    "gappo-no-attention": (
        "attention",
        "an agent sees its group and other tasks only through aggregate features, such as total ability and count",
    ),
    "gappo-on-policy": (
        "replay",
        "each game is used for one update only; fewer gradient steps for the same number of decisions",
    ),
}
"""Component that each variant lacks, and what that means."""

_PPO: Mapping[str, object] = {
    "learning_rate": 0.003274,
    "gamma": 0.9782,
    "gae_lambda": 0.8767,
    "clip_coef": 0.3271,
    "ent_coef": 0.006903,
    "update_epochs": 2,
    "minibatch_size": 219,
}

TUNED: Mapping[str, Mapping[str, object]] = {
    "gappo": {**_PPO, "target_kl": 0.02244},
    "ppo": _PPO,
    "a2c": {"learning_rate": 0.0011, "num_steps": 2, "gamma": 0.97, "ent_coef": 0.024},
    "dqn": {
        "learning_rate": 0.00112,
        "gamma": 0.7673,
        "temperature": 0.2235,
        "batch_size": 228,
        "target_update_interval": 178,
    },
    "ddpg": {
        "learning_rate": 0.0008559,
        "gamma": 0.8291,
        "softmax_temperature": 0.7769,
        "ent_coef": 0.007846,
        "batch_size": 77,
        "tau": 0.01958,
    },
}
"""Hyperparameters: the best of twelve trials of 60,000 decisions for each method, by the search of `alloc tune`; GAPPO
has those of PPO, which it extends, and the divergence target of twelve trials of its own."""

OTHERS = ("greedy", "ga", "local-search", "milp", "cpsat")
"""Methods that do not learn, run on the same instances."""

SCENARIOS = (1, 2, 3, 4)

ITERATIONS: Mapping[int, int] = {1: 200, 2: 300, 3: 300, 4: 300}
"""The paper's, of each scenario."""

OTHER_SCENARIO_RUNS = 10
"""Number of runs with instances of scenarios 2 to 4; later runs have one of scenario 1 only."""

DECISIONS = 200
"""Decisions of agents in an iteration, over all members of a population; the paper gives no unit."""

POINTS = (5, 10, 25, 50, 75, 100, 125, 150, 175, 200, 225, 250, 275, 300)
"""Iterations after which a policy is evaluated, besides 0."""

ENERGY_WEIGHT = 0.3
"""Weight of energy in all games."""

INSTANCE_SEED = 6000
"""Seed of the instances of the first run; those of the others follow. Nothing is trained or tuned on them."""

TEST_SEED, TEST_GAMES = 5000, 12
"""Further instances of scenario 1, the same for all runs: the comparison with the highest power."""

TESTS = 0
"""Stands for the test games where rows have the number of a scenario."""

DRAWN = 8
"""Games with sampled bids on each test instance at the end of a run, of which the best counts."""

PAPER_BATTERY: Mapping[str, Mapping[int, tuple[float, float]]] = {
    "gappo": {1: (91.9, 91.9), 2: (91.7, 91.8), 3: (91.7, 91.8), 4: (91.7, 91.8)},
    "others": {1: (52.2, 55.5), 2: (74.2, 81.6), 3: (74.2, 81.6), 4: (74.2, 81.6)},
}
"""Range of the remaining battery in percent in the text on figure 6, which gives none for scenario 2 alone."""


@dataclass(frozen=True, order=True)
class Job:
    """One run: a training, or the solving of the instances of a run by a method that does not learn.

    Attributes
    ----------
    run : int
        From 0; determines the instances and all random numbers.
    method : str
        Of `VARIANTS` or `OTHERS`.
    iterations : int
        Of a training, at most 300.
    time_limit_s : float
        Of solving one instance.
    """

    run: int
    method: str
    iterations: int = 300
    time_limit_s: float = 1.0

    @property
    def learns(self) -> bool:
        """Whether the method learns."""
        return self.method in VARIANTS


def scenarios_of(run: int) -> tuple[int, ...]:
    """Return the scenarios on which a run is evaluated."""
    return SCENARIOS if run < OTHER_SCENARIO_RUNS else SCENARIOS[:1]


def judged(scenario: int, iterations: int) -> list[int]:
    """Return the iterations after which a policy is evaluated on a scenario or on the test games."""
    most = iterations if scenario == TESTS else min(iterations, ITERATIONS[scenario])
    return [0, *(point for point in POINTS if point <= most)]


def expected(job: Job) -> set[tuple[int, int]]:
    """Return scenario and iteration of each row of a run; a method that does not learn has only iteration 0."""
    if not job.learns:
        return {(scenario, 0) for scenario in scenarios_of(job.run)}
    played = (TESTS, *scenarios_of(job.run))
    return {(scenario, point) for scenario in played for point in judged(scenario, job.iterations)}


def planned(runs: int, methods: tuple[str, ...], iterations: int, time_limit_s: float) -> list[Job]:
    """Return all jobs, ordered by run, so that any prefix of them compares all methods alike."""
    return [Job(run, method, iterations, time_limit_s) for run in range(runs) for method in methods]
