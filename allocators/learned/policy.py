"""Trained policies as allocators: the planner with the networks of a policy file."""

from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path

import torch

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.search import Search
from alloc.allocators.learned.algorithms.hyperparameters import DqnParameters
from alloc.allocators.learned.files.policy_file import load_policy
from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.batched_games import warm_up as play_once
from alloc.allocators.learned.play.limits import too_large
from alloc.allocators.learned.search.fine_tuning import FineTuning
from alloc.allocators.learned.search.planner import Planner, PlannerParameters
from alloc.allocators.runtime.torch_state import plain_torch, torch_threads
from alloc.problems import Allocation, InputError, Instance, Objective
from alloc.problems.arguments import text

GPU_PAIRS, GPU_GAMES = 40_000, 512
"""`pairs_per_stream` and `games_per_region` of the planner on a GPU, where ten times as many games take no longer."""

START_ENERGY_WEIGHT = 2.0
"""Weight of energy in the game from which local search starts, without travel times."""


class PolicyAllocator(Allocator):
    """Base class of learned policies, as shipped or from a file by `alloc train`; subclasses define the method.

    Parameters
    ----------
    policy : Path or str, optional
        Policy file; by default the one that is part of the package.
    device : str
        Device on which the networks run, such as ``cpu`` or ``cuda``.

    Raises
    ------
    InputError
        If the file is not a policy file or does not fit this version, or there is no such device.
    """

    trained_by: str
    parameters = PlannerParameters()

    def __init__(self, policy: Path | str | None = None, device: str = "cpu") -> None:
        self.device, self.policy = usable(device), None if policy is None else str(policy)
        if self.device.type != "cpu":
            self.parameters = replace(self.parameters, pairs_per_stream=GPU_PAIRS, games_per_region=GPU_GAMES)
        with plain_torch():
            self.networks = self._read(policy)
            play_once(self.networks[0])

    def _read(self, policy: Path | str | None) -> list[ActorCritic]:
        if policy is not None:
            return load_policy(policy, self.trained_by, self.device)
        with as_file(
            files("alloc.allocators.learned.files") / "policies" / f"{self.trained_by}.safetensors"
        ) as shipped:
            return load_policy(shipped, self.trained_by, self.device)

    def changed_parameters(self) -> dict[str, object]:
        """Return the policy file and the device if they differ from the defaults."""
        given = {"policy": self.policy, "device": str(self.device)}
        return {name: value for name, value in given.items() if value not in (None, "cpu")}

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse instances on which not even one game would end in time."""
        return too_large(instance, budget)

    def allocate(self, search: Search) -> Proposal:
        """Play games and submit improvements until the budget ends."""
        if not (search.instance.workload > 0).any():
            return Proposal(Allocation.idle(search.instance))
        with plain_torch(), torch_threads(1):  # for small tensors, a second thread costs more than it saves
            self.plan(search)
        return Proposal()

    def plan(self, search: Search) -> None:
        """Run the planner."""
        Planner(search, self.networks, self.parameters).run()


class Ppo(PolicyAllocator):
    """One actor-critic, trained by proximal policy optimisation."""

    method, trained_by = BUILT_IN["ppo"], "ppo"


class A2c(PolicyAllocator):
    """One actor-critic, trained by advantage actor-critic."""

    method, trained_by = BUILT_IN["a2c"], "a2c"


class Dqn(PolicyAllocator):
    """A network that estimates the utility of each bid."""

    method, trained_by = BUILT_IN["dqn"], "dqn"
    parameters = PlannerParameters(temperature=(DqnParameters().final_temperature, DqnParameters().temperature))


class Ddpg(PolicyAllocator):
    """An actor that follows the gradient of a critic."""

    method, trained_by = BUILT_IN["ddpg"], "ddpg"


class Gappo(PolicyAllocator):
    """A population of actor-critics, which is fine-tuned on the instance itself if time permits.

    References
    ----------
    Fang et al. (2025), doi:10.20944/preprints202502.0192.v1.
    """

    method, trained_by = BUILT_IN["gappo"], "gappo"

    def plan(self, search: Search) -> None:
        """Run the planner with fine-tuning, which works on the CPU only."""
        tuning = FineTuning(search, self.networks) if self.device.type == "cpu" else None
        Planner(search, self.networks, self.parameters, tuning).run()


class GappoLs(Gappo):
    """A hybrid: the first plan of the policies, improved by local search."""

    method = BUILT_IN["gappo-ls"]

    def __init__(self, policy: Path | str | None = None, device: str = "cpu") -> None:
        from alloc.allocators.heuristic.local_search.annealing_state import compile_loops

        super().__init__(policy, device)
        compile_loops()

    def plan(self, search: Search) -> None:
        """Play one game on the whole instance, and improve its plan by local search."""
        from alloc.allocators.heuristic.local_search.improve import improve

        energy_weight = self.parameters.first_energy_weight if search.instance.has_travel_time else START_ENERGY_WEIGHT
        Planner(search, self.networks, self.parameters).play_whole(energy_weight)
        with search.improving("local search"):
            improve(search)


def usable(device: str) -> torch.device:
    """Return the torch device with this name.

    Raises
    ------
    InputError
        If it cannot be used on this machine.
    """
    try:
        torch.zeros(1, device=text(device, "device")).item()
        return torch.device(device)
    except torch.OutOfMemoryError as error:
        raise InputError(f"{device!r} has no memory left", "device") from error
    except (RuntimeError, AssertionError, ImportError) as error:  # torch's message would not help users
        able = "cpu or cuda" if torch.cuda.is_available() else "cpu"
        raise InputError(f"{device!r} cannot be used here; use {able}", "device") from error
