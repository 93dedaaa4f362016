"""Missions as a Gymnasium environment: one learner gives orders to all agents, with full knowledge."""

from __future__ import annotations

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from alloc.problems.environments.missions.decisions import Decisions, Source, Weights, draw, sizes_of
from alloc.problems.environments.missions.observation import LIMIT, Floats, Lens, length
from alloc.problems.environments.missions.truth import RENDER_MODES, Truth, checked_mode, rendered, show_step
from alloc.problems.errors import InputError
from alloc.problems.vocabulary import Knowledge


class MissionFleetEnv(gymnasium.Env[Floats, np.int64]):
    """A planner decides for one free agent per step.

    After every event - a task appears or is done, an agent joins, fails or arrives - each free agent gets an order in
    turn: action j sends it to task j, action m continues with its last order. Observations and rewards are those of
    `MissionEnv` for the selected agent, with full knowledge. The mission is over when all tasks are done, no agents
    remain, or its horizon is reached.

    Illegal actions - a task that has not appeared, is over, or that the agent cannot take - change nothing and give
    `illegal_reward`; `action_masks` returns the legal ones, as MaskablePPO of sb3-contrib expects. Infos contain
    ``agent``, the number of the selected agent, hour, tasks done, energy and ``illegal``, at the end also the measures.

    Parameters
    ----------
    missions : sequence of Mission, or callable
        Sampled at every reset, or a function that is called with a numpy generator; all of the same size.
    switching : bool
        Whether agents that fly or work also get orders.
    waiting_weight, energy_weight : float
        Weights in the reward; see `MissionEnv`.
    max_steps : int, optional
        Decisions after which the mission is truncated; by default none.
    illegal_reward : float
    render_mode : {"ansi", "human"}, optional
        Whether `render` returns the true state as text, or prints it.

    Raises
    ------
    InputError
        If missions differ in size, or the render mode is unknown.

    References
    ----------
    Towers et al. (2024), arXiv:2407.17032.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 1}  # noqa: RUF012

    def __init__(
        self,
        missions: Source,
        *,
        switching: bool = False,
        waiting_weight: float = 0.5,
        energy_weight: float = 0.0,
        max_steps: int | None = None,
        illegal_reward: float = 0.0,
        render_mode: str | None = None,
    ) -> None:
        self._source, self._sizes = missions, sizes_of(missions)
        self._switching, self._weights = switching, Weights(waiting_weight, energy_weight)
        self.max_steps, self.illegal_reward = max_steps, illegal_reward
        self.render_mode = checked_mode(render_mode)
        n, m = self._sizes
        self.observation_space = spaces.Box(-LIMIT, LIMIT, (length(n, m),), np.float32)
        self.action_space = spaces.Discrete(m + 1)
        self._course: Decisions
        self._lens: Lens
        self._truth: Truth
        self._agent = self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[Floats, dict[str, object]]:
        """Start a new random mission; with a seed, the sequence of missions is reproducible."""
        super().reset(seed=seed)
        mission = draw(self._source, self._sizes, self.np_random)
        self._course = Decisions(mission, Knowledge.FULL, 0, switching=self._switching, weights=self._weights)
        if not self._course.queue:
            raise InputError("is over before the first decision", mission.name)
        self._lens, self._truth = Lens(mission, 0), Truth(mission)
        self._agent, self._steps = self._course.queue[0], 0
        show_step(self._course.state, self.render_mode)
        return self._observation(), self._info(illegal=False)

    def step(self, action: np.int64) -> tuple[Floats, float, bool, bool, dict[str, object]]:
        """Give an order to the selected agent, and advance to the next decision."""
        number = int(action)
        is_legal = bool(self.action_masks()[number])
        gained = self._course.decide(self._lens.order(number) if is_legal else None)
        gained += 0.0 if is_legal else self.illegal_reward
        self._steps += 1
        over = not self._course.queue
        self._agent = self._agent if over else self._course.queue[0]
        cut = not over and self.max_steps is not None and self._steps >= self.max_steps
        show_step(self._course.state, self.render_mode)
        return self._observation(), gained, over, cut, self._info(illegal=not is_legal)

    def state(self) -> Floats:
        """Return the true state, as described by `Truth` of `truth.py`."""
        return self._truth.array(self._course.state)

    def render(self) -> str | None:
        """Return the true state as text, or print it, depending on the render mode."""
        return rendered(self._course.state, self.render_mode)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are legal now, shape (m + 1,)."""
        return self._lens.mask(self._course.view(self._agent)).astype(np.bool_)

    def _observation(self) -> Floats:
        return self._lens.observe(self._course.view(self._agent))

    def _info(self, *, illegal: bool) -> dict[str, object]:
        return {**self._course.figures(), "agent": self._agent, "illegal": illegal}
