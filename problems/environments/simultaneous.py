"""The paper's game as a PettingZoo environment: agents choose simultaneously, and see what is in their range."""

from __future__ import annotations

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from alloc.problems.environments.episode import Game, Info, Source, draw, episode_figures, plan_figures, sizes_of
from alloc.problems.environments.observation import AGENT_FIGURES, LIMIT, TASK_FIGURES, observe
from alloc.problems.errors import InputError
from alloc.problems.game import PAPER, Rules, State, TurnRule, action_mask, difference_rewards, reset, step

Observation = dict[str, NDArray[np.generic]]


class SimultaneousEnv(ParallelEnv[str, Observation, int]):  # type: ignore[misc]
    """All agents simultaneously go to a task in C(i), become idle, or stay.

    The action of an agent is the number of a task, or m to become idle. Masked actions count as staying. Observations
    are dictionaries of

    - ``agent``, shape (7,): position, share of the battery left, ability, whether idle, and share of the steps gone;
    - ``tasks``, shape (m, 9): for each task the ability that it needs, its priority, the flight there, what the agent
      would contribute, and whether it is within communication range; if so, the occupancy map: ability there, number
      of members, shortfall of ability; last, whether the agent is there;
    - ``action_mask``, shape (m + 1,).

    They have the units of `Board` and are clipped at `LIMIT`. The reward of an agent is the loss of total utility if it
    alone had stayed (`difference_rewards`). A step in which no agent moves ends the game. Infos contain
    ``episode_energy``, ``episode_battery`` (in percent) and whether the action was ``illegal``, at the end also the
    scores of the plan.

    Parameters
    ----------
    instances : sequence of Instance, or callable
        Sampled at every reset, or a function that is called with a numpy generator.
    rules : Rules
        Rules with simultaneous turns; by default those of the paper.
    energy_weight : float
        Weight of energy in the reward.
    max_steps : int
        Steps after which the game is truncated.

    Raises
    ------
    InputError
        If the rules are not simultaneous, or instances differ in size.

    References
    ----------
    Fang et al. (2025), section 2.2, doi:10.20944/preprints202502.0192.v1; Terry et al. (2021), arXiv:2009.14471.
    """

    metadata = {"name": "alloc_simultaneous_v0", "render_modes": [], "is_parallelizable": True}  # noqa: RUF012

    def __init__(
        self, instances: Source, *, rules: Rules = PAPER, energy_weight: float = 0.5, max_steps: int = 20
    ) -> None:
        if rules.turn != TurnRule.SIMULTANEOUS:
            raise InputError("must be simultaneous in this environment; use BiddingEnv for bidding", "turn")
        self._source, self._sizes = instances, sizes_of(instances)
        self.rules, self.energy_weight, self.max_steps = rules, energy_weight, max_steps
        n, m = self._sizes
        self.possible_agents = [f"agent_{number}" for number in range(n)]
        self.agents: list[str] = []
        self.render_mode = None
        self._number = {agent: number for number, agent in enumerate(self.possible_agents)}
        self._observes = {agent: _observation_space(m) for agent in self.possible_agents}
        self._acts = {agent: spaces.Discrete(m + 1) for agent in self.possible_agents}
        self._rng: np.random.Generator | None = None
        self._game: Game
        self._state: State
        self._steps = 0

    def observation_space(self, agent: str) -> spaces.Dict:
        """Return the space of an agent's observations."""
        return self._observes[agent]

    def action_space(self, agent: str) -> spaces.Discrete:
        """Return the space of an agent's actions."""
        return self._acts[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[dict[str, Observation], dict[str, Info]]:
        """Start a game on a new random instance; with a seed, the sequence of games is reproducible."""
        if seed is not None or self._rng is None:
            self._rng = np.random.default_rng(seed)
        self._game = draw(self._source, self._sizes, self.energy_weight, self._rng)
        self._state, self._steps = reset(self._game.board), 0
        self.agents = list(self.possible_agents)
        return self._observations(), self._infos(frozenset(), over=False)

    def step(
        self, actions: dict[str, int]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Info]]:
        """Apply the actions of all agents; agents without an action stay."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        board, before, mask = self._game.board, self._state, self._mask()
        slot, illegal = before.slot.clone(), set()
        for agent, action in actions.items():
            number = self._number[agent]
            if mask[number, action]:
                slot[0, number] = int(action)
            else:
                illegal.add(agent)
        rewards = difference_rewards(board, before, slot, self.rules)[0].tolist()
        self._state = step(board, before, slot)
        self._steps += 1
        ended = bool(self._state.done)
        cut = not ended and self._steps >= self.max_steps
        agents = self.agents
        observations, infos = self._observations(), self._infos(frozenset(illegal), over=ended or cut)
        self.agents = [] if ended or cut else agents
        return (
            observations,
            dict(zip(agents, rewards, strict=True)),
            dict.fromkeys(agents, ended),
            dict.fromkeys(agents, cut),
            infos,
        )

    def _mask(self) -> NDArray[np.int8]:
        can = action_mask(self._game.board, self._state, self.rules)
        return can.scatter(2, self._state.slot[..., None], True)[0].to(torch.int8).numpy()

    def _observations(self) -> dict[str, Observation]:
        agents, tasks = observe(self._game, self._state, self._steps / self.max_steps)
        rows = zip(self.agents, agents, tasks, self._mask(), strict=True)
        return {
            agent: {"agent": one.copy(), "tasks": all_.copy(), "action_mask": mask.copy()}
            for agent, one, all_, mask in rows
        }

    def _infos(self, illegal: frozenset[str], over: bool) -> dict[str, Info]:
        figures = episode_figures(self._game, self._state)
        if over:
            figures.update(plan_figures(self._game, self._state))
        return {agent: {**figures, "illegal": agent in illegal} for agent in self.agents}


def _observation_space(m: int) -> spaces.Dict:
    return spaces.Dict(
        {
            "agent": spaces.Box(-LIMIT, LIMIT, (AGENT_FIGURES,), np.float32),
            "tasks": spaces.Box(-LIMIT, LIMIT, (m, TASK_FIGURES), np.float32),
            "action_mask": spaces.Box(0, 1, (m + 1,), np.int8),
        }
    )
