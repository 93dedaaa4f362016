"""The game with one bid per step as a Gymnasium environment, for single-agent learners."""

from __future__ import annotations

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray

from alloc.problems.environments.episode import Game, Info, Source, draw, episode_figures, plan_figures, sizes_of
from alloc.problems.errors import InputError
from alloc.problems.game import (
    PAIR_FEATURES,
    TASK_FEATURES,
    Rules,
    State,
    TurnRule,
    action_mask,
    apply_moves,
    marginal_contributions,
    observe_pairs,
    observe_tasks,
    reset,
    step,
)

ONE_BY_ONE = Rules(most_moves=1)


class BiddingEnv(gymnasium.Env[NDArray[np.float32], np.int64]):
    """A planner moves one agent per step, until it stops.

    Action ``agent * (m + 1) + task`` sends an agent to a task, where task m means idle; ``n * (m + 1)`` stops.
    Observations are the flattened `observe_pairs` and `observe_tasks`, as the policies of this package use them, with
    values within -2 and 2. The reward is the marginal contribution of the move: the rewards of an episode sum to the
    increase of `utility`.

    Illegal actions - to a task where the agent is, cannot go, or has been before - change nothing, give
    `illegal_reward` and use up a step; `action_masks` returns the legal ones, as MaskablePPO of sb3-contrib expects.
    Infos contain ``episode_energy``, ``episode_battery`` (in percent) and ``illegal``, at the end also the scores of
    the plan.

    Parameters
    ----------
    instances : sequence of Instance, or callable
        Sampled at every reset, or a function that is called with a numpy generator.
    rules : Rules
        Rules with bidding; one bid per step is granted, whatever `most_moves` is.
    energy_weight : float
        Weight of energy in the reward.
    max_steps : int, optional
        Steps after which the game is truncated; by default four per agent.
    illegal_reward : float

    Raises
    ------
    InputError
        If the rules are not bidding, or instances differ in size.

    References
    ----------
    Towers et al. (2024), arXiv:2407.17032.
    """

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        instances: Source,
        *,
        rules: Rules = ONE_BY_ONE,
        energy_weight: float = 0.5,
        max_steps: int | None = None,
        illegal_reward: float = 0.0,
    ) -> None:
        if rules.turn != TurnRule.BIDDING:
            raise InputError(
                "must be bidding in this environment; use SimultaneousEnv for simultaneous choices", "turn"
            )
        self._source, self._sizes = instances, sizes_of(instances)
        n, m = self._sizes
        self.rules, self.energy_weight, self.illegal_reward = rules, energy_weight, illegal_reward
        self.max_steps = 4 * n if max_steps is None else max_steps
        size = (m + 1) * (n * PAIR_FEATURES + TASK_FEATURES)
        self.observation_space = spaces.Box(-2, 2, (size,), np.float32)
        self.action_space = spaces.Discrete(n * (m + 1) + 1)
        self._game: Game
        self._state: State
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, object]]:
        """Start a game on a new random instance; with a seed, the sequence of games is reproducible."""
        super().reset(seed=seed)
        self._game = draw(self._source, self._sizes, self.energy_weight, self.np_random)
        self._state, self._steps = reset(self._game.board), 0
        return self._observation(), self._info(illegal=False, over=False)

    def step(self, action: np.int64) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, object]]:
        """Move an agent, or stop."""
        board, before, number = self._game.board, self._state, int(action)
        legal = bool(self.action_masks()[number])
        reward, self._steps = self.illegal_reward, self._steps + 1
        if legal:
            bid = torch.tensor([[number]])
            reward = marginal_contributions(board, before, bid, self.rules).item()
            self._state = step(board, before, apply_moves(board, before, bid))
        ended = bool(self._state.done)
        cut = not ended and self._steps >= self.max_steps
        return self._observation(), reward, ended, cut, self._info(illegal=not legal, over=ended or cut)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are legal now, shape (n * (m + 1) + 1,)."""
        can = action_mask(self._game.board, self._state, self.rules).flatten().numpy()
        return np.append(can, not bool(self._state.done))

    def _observation(self) -> NDArray[np.float32]:
        board, state = self._game.board, self._state
        regions = [observe_pairs(board, state).flatten(), observe_tasks(board, state).flatten()]
        figures: NDArray[np.float32] = torch.cat(regions).numpy()
        return figures

    def _info(self, illegal: bool, over: bool) -> dict[str, object]:
        info: Info = {**episode_figures(self._game, self._state), "illegal": illegal}
        if over:
            info.update(plan_figures(self._game, self._state))
        return dict(info)
