"""Missions as a PettingZoo environment: agents decide in turn as they become free, with their own knowledge."""

from __future__ import annotations

from typing import TypedDict

import numpy as np
from gymnasium import spaces
from pettingzoo import AECEnv

from alloc.problems.arguments import whole
from alloc.problems.environments.missions.decisions import Decisions, Info, Source, Weights, draw, sizes_of
from alloc.problems.environments.missions.observation import LIMIT, Floats, Lens, Mask, length
from alloc.problems.environments.missions.truth import (
    RENDER_MODES,
    Truth,
    checked_mode,
    rendered,
    show_step,
    state_length,
)
from alloc.problems.errors import InputError
from alloc.problems.vocabulary import Knowledge


class Observation(TypedDict):
    """Observation of an agent."""

    observation: Floats
    action_mask: Mask


class MissionEnv(AECEnv[str, Observation, int]):  # type: ignore[misc]
    """Each free agent chooses a task, a place to explore, or to continue with its last order.

    A mission runs in continuous time; `agent_selection` is the next agent to decide: with local knowledge, each free
    agent at every radio period and when its task or flight ends; with full knowledge, each free agent after every
    event. Agents share all their knowledge. Action j is task j, action m + k is place k on a grid over the area, and
    the last action continues with the last order, so that an idle agent stays idle. Masked actions count as the last
    one.

    Observations are dictionaries as in PettingZoo's classic games: ``observation``, only what the agent has sensed or
    received, as described by `Lens` of `observation.py`, within -10 and 10; and ``action_mask``. All agents get the
    same reward: the share of priority done, minus the weighted waiting hours of tasks and the weighted energy, which
    sum to the result of the mission. When a mission is over, all agents are terminated. Infos contain hour, tasks done,
    energy and whether the agent's last action was ``illegal``, at the end also mission time (``inf`` if not all tasks
    are done), priority done, switches and messages.

    Parameters
    ----------
    missions : sequence of Mission, or callable
        Sampled at every reset, or a function that is called with a numpy generator; all of the same size.
    knowledge : {"full", "local"}, optional
        By default, as each mission says.
    grid : int
        Places on each side of the grid of places to explore; 0 for none.
    switching : bool
        Whether agents that fly or work also decide.
    waiting_weight, energy_weight : float
        Weights in the reward.
    max_steps : int, optional
        Decisions after which the mission is truncated; by default none, as missions end by themselves.
    render_mode : {"ansi", "human"}, optional
        Whether `render` returns the true state as text, or prints it.

    Raises
    ------
    InputError
        If missions differ in size, or the render mode is unknown.

    References
    ----------
    Terry et al. (2021), arXiv:2009.14471.
    """

    metadata = {"name": "alloc_mission_v0", "render_modes": list(RENDER_MODES), "is_parallelizable": False}  # noqa: RUF012

    def __init__(
        self,
        missions: Source,
        *,
        knowledge: Knowledge | str | None = None,
        grid: int = 3,
        switching: bool = False,
        waiting_weight: float = 0.5,
        energy_weight: float = 0.0,
        max_steps: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__()
        self._source, self._sizes = missions, sizes_of(missions)
        self._knowledge, self._switching, self._grid = knowledge, switching, whole(grid, "grid", 0, 100)
        self._weights, self.max_steps = Weights(waiting_weight, energy_weight), max_steps
        n, m = self._sizes
        self.possible_agents = [f"agent_{number}" for number in range(n)]
        self.agents: list[str] = []
        self.render_mode = checked_mode(render_mode)
        self.state_space = spaces.Box(-LIMIT, LIMIT, (state_length(n, m),), np.float32)
        choices = m + self._grid**2 + 1
        self._observes = {name: _space(length(n, m), choices) for name in self.possible_agents}
        self._acts = {name: spaces.Discrete(choices) for name in self.possible_agents}
        self._rng: np.random.Generator | None = None
        self._course: Decisions
        self._lens: Lens
        self._truth: Truth
        self._steps = 0

    def observation_space(self, agent: str) -> spaces.Dict:
        """Return the space of an agent's observations."""
        return self._observes[agent]

    def action_space(self, agent: str) -> spaces.Discrete:
        """Return the space of an agent's actions."""
        return self._acts[agent]

    def reset(self, seed: int | None = None, options: dict[str, object] | None = None) -> None:
        """Start a new random mission; with a seed, the sequence of missions is reproducible."""
        if seed is not None or self._rng is None:
            self._rng = np.random.default_rng(seed)
        mission = draw(self._source, self._sizes, self._rng)
        number = int(self._rng.integers(2**63))
        self._course = Decisions(mission, self._knowledge, number, switching=self._switching, weights=self._weights)
        if not self._course.queue:
            raise InputError("is over before the first decision", mission.name)
        self._lens, self._truth, self._steps = Lens(mission, self._grid), Truth(mission), 0
        self.agents = list(self.possible_agents)
        self.rewards = dict.fromkeys(self.agents, 0.0)
        self._cumulative_rewards = dict.fromkeys(self.agents, 0.0)
        self.terminations, self.truncations = dict.fromkeys(self.agents, False), dict.fromkeys(self.agents, False)
        figures = self._course.figures()
        self.infos: dict[str, Info] = {name: {**figures, "illegal": False} for name in self.agents}
        self._skip_agent_selection = None
        self.agent_selection = self.agents[self._course.queue[0]]
        show_step(self._course.state, self.render_mode)

    def observe(self, agent: str) -> Observation:
        """Return what an agent knows now, and its action mask."""
        view = self._course.view(self.possible_agents.index(agent))
        return {"observation": self._lens.observe(view), "action_mask": self._lens.mask(view)}

    def state(self) -> Floats:
        """Return the true state, as described by `Truth` of `truth.py`, for a centralised critic."""
        return self._truth.array(self._course.state)

    def render(self) -> str | None:
        """Return the true state as text, or print it, depending on the render mode."""
        return rendered(self._course.state, self.render_mode)

    def close(self) -> None:
        """Do nothing, as there is no window."""

    def step(self, action: int | None) -> None:
        """Apply the action of the selected agent, and advance to the next decision."""
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        view = self._course.view(self._course.queue[0])
        assert action is not None
        is_legal = bool(self._lens.mask(view)[action])
        self._cumulative_rewards[agent] = 0.0
        gained = self._course.decide(self._lens.order(int(action)) if is_legal else None)
        self._steps += 1
        self.rewards = dict.fromkeys(self.agents, gained)
        self._accumulate_rewards()
        over = not self._course.queue
        cut = not over and self.max_steps is not None and self._steps >= self.max_steps
        self.terminations, self.truncations = dict.fromkeys(self.agents, over), dict.fromkeys(self.agents, cut)
        figures = self._course.figures()
        illegal = {name: info["illegal"] for name, info in self.infos.items()} | {agent: not is_legal}
        self.infos = {name: {**figures, "illegal": illegal[name]} for name in self.agents}
        self.agent_selection = self.agents[0 if over or cut else self._course.queue[0]]
        show_step(self._course.state, self.render_mode)


def _space(figures: int, choices: int) -> spaces.Dict:
    return spaces.Dict(
        {
            "observation": spaces.Box(-LIMIT, LIMIT, (figures,), np.float32),
            "action_mask": spaces.Box(0, 1, (choices,), np.int8),
        }
    )
