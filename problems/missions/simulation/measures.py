"""Measures of a finished mission (alloc-mission-result/1)."""

import math
from dataclasses import dataclass, fields

import numpy as np

from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import AgentState, TaskState, TaskStatus

RESULT_FORMAT = "alloc-mission-result/1"


@dataclass(frozen=True)
class DecisionTimes:
    """Statistics of a policy's decision times.

    Attributes
    ----------
    count : int
        Number of decisions.
    late : int
        Number of decisions after the deadline, which were ignored.
    mean_ms, p99_ms, worst_ms : float or None
        None if there were no decisions.
    runtime_s : float
        Runtime of the whole simulation.
    """

    count: int = 0
    late: int = 0
    mean_ms: float | None = None
    p99_ms: float | None = None
    worst_ms: float | None = None
    runtime_s: float = 0.0

    @classmethod
    def of(cls, seconds: list[float], late: int, runtime_s: float) -> "DecisionTimes":
        """Return the statistics of decisions with these durations in seconds."""
        if not seconds:
            return cls(runtime_s=runtime_s)
        ms = 1000 * np.array(seconds)
        worst = float(ms.max())
        return cls(len(ms), late, float(ms.mean()), float(np.percentile(ms, 99)), worst, runtime_s)


@dataclass(frozen=True)
class MissionResult:
    """Measures of a finished mission.

    Attributes
    ----------
    mission, policy, knowledge : str
    seed : int
    status : {"done", "unfinished"}
        ``done`` if all tasks are done, except cancelled ones.
    mission_time : float or None
        Hour at which the last task was done; None if a task was missed or is left.
    tasks_done, tasks_missed, tasks_left : int
    priority_done_share : float
        Priority of the tasks done, relative to that of all tasks except cancelled ones.
    completion_hours_mean, completion_hours_p95 : float or None
        Mean and 95th percentile of the hours from appearance to completion, weighted by priority.
    energy, distance, distance_worst_agent : float
    battery_remaining_percent : float or None
        Battery left, relative to the initial charge plus recharges; mean over agents with a battery.
    switches : int
        Number of orders that sent a flying or working agent elsewhere while its task had work left.
    messages, bytes, messages_busiest_agent : int
    decisions, decisions_late, orders_refused : int
    decision_ms_mean, decision_ms_p99, decision_ms_worst : float or None
    work_given_up : float
        Work left at the end of tasks that had been begun.
    mission_time_lower_bound : float or None
        Proven lower bound on the mission time of any policy; None if there is none.
    runtime_s : float
    """

    mission: str
    policy: str
    knowledge: str
    seed: int
    status: str
    mission_time: float | None
    tasks_done: int
    tasks_missed: int
    tasks_left: int
    priority_done_share: float
    completion_hours_mean: float | None
    completion_hours_p95: float | None
    energy: float
    distance: float
    distance_worst_agent: float
    battery_remaining_percent: float | None
    switches: int
    messages: int
    bytes: int
    messages_busiest_agent: int
    decisions: int
    decisions_late: int
    decision_ms_mean: float | None
    decision_ms_p99: float | None
    decision_ms_worst: float | None
    orders_refused: int
    work_given_up: float
    mission_time_lower_bound: float | None
    runtime_s: float

    def to_dict(self) -> dict[str, object]:
        """Return the fields by name, as in a file."""
        return {"format": RESULT_FORMAT, **{field.name: getattr(self, field.name) for field in fields(self)}}

    @property
    def times(self) -> DecisionTimes:
        """Decision times, which a replay cannot reproduce."""
        times = (self.decision_ms_mean, self.decision_ms_p99, self.decision_ms_worst, self.runtime_s)
        return DecisionTimes(self.decisions, self.decisions_late, *times)

    @property
    def is_done(self) -> bool:
        """Whether all tasks are done, except cancelled ones."""
        return self.status == "done"


def measured(simulation: Simulation, policy: str, seed: int, times: DecisionTimes) -> MissionResult:
    """Return the measures of a finished simulation.

    Parameters
    ----------
    simulation : Simulation
    policy : str
        Name of the policy.
    seed : int
        Seed of the run.
    times : DecisionTimes
    """
    state = simulation.state
    wanted = [task for task in state.tasks if task.status is not TaskStatus.CANCELLED]
    done = [task for task in wanted if task.status is TaskStatus.DONE]
    is_done = len(done) == len(wanted)
    missed = sum(task.status is TaskStatus.MISSED for task in wanted)
    total = math.fsum(task.facts.priority for task in wanted)
    mean, p95 = _completion_hours(done)
    distances = [agent.distance for agent in state.agents]
    return MissionResult(
        mission=simulation.mission.name,
        policy=policy,
        knowledge=str(simulation.knowledge),
        seed=seed,
        status="done" if is_done else "unfinished",
        mission_time=max((task.closed for task in done), default=0.0) if is_done else None,
        tasks_done=len(done),
        tasks_missed=missed,
        tasks_left=len(wanted) - len(done) - missed,
        priority_done_share=math.fsum(task.facts.priority for task in done) / total if total else float(is_done),
        completion_hours_mean=mean,
        completion_hours_p95=p95,
        energy=math.fsum(agent.energy for agent in state.agents),
        distance=math.fsum(distances),
        distance_worst_agent=max(distances),
        battery_remaining_percent=_battery_percent(state.agents),
        switches=state.switches,
        messages=sum(simulation.messages),
        bytes=sum(simulation.bytes),
        messages_busiest_agent=max(simulation.messages),
        decisions=times.count,
        decisions_late=times.late,
        decision_ms_mean=times.mean_ms,
        decision_ms_p99=times.p99_ms,
        decision_ms_worst=times.worst_ms,
        orders_refused=sum(record["record"] == "refused" for record in simulation.log.records),
        work_given_up=math.fsum(task.left for task in wanted if task.begun),
        mission_time_lower_bound=lower_bound(simulation.mission),
        runtime_s=times.runtime_s,
    )


def _completion_hours(done: list[TaskState]) -> tuple[float | None, float | None]:
    """Return the mean and the 95th percentile of the hours from appearance to completion, weighted by priority."""
    hours = sorted((task.closed - task.facts.appears, task.facts.priority) for task in done)
    total = math.fsum(weight for _, weight in hours)
    if total <= 0:
        return None, None
    mean = math.fsum(hour * weight for hour, weight in hours) / total
    passed = 0.0
    for hour, weight in hours:
        passed += weight
        if passed >= 0.95 * total * (1 - 1e-12):
            return mean, hour
    return mean, hours[-1][0]


def _battery_percent(agents: list[AgentState]) -> float | None:
    shares = [
        1.0 if agent.capacity == 0 else min(1.0, max(0.0, agent.battery / agent.capacity))
        for agent in agents
        if agent.capacity < math.inf
    ]
    return 100 * math.fsum(shares) / len(shares) if shares else None


def lower_bound(mission: Mission) -> float | None:
    """Return a lower bound on the mission time of any policy; None if events may invalidate it.

    The bound is the larger of the time that all agents together need for all work, and that which they need for any
    single task after it appears, with flights that take no time and without late or failing agents.
    """
    if any(event.task is not None and event.workload is not None for event in mission.events):
        return None
    cancelled = {event.task for event in mission.events if str(event.kind) == "task-cancelled"}
    kept = np.array([name not in cancelled for name in mission.instance.task_ids])
    fastest = float(mission.instance.ability.sum()) * (mission.pace.high if mission.pace else 1.0)
    work = np.where(kept, mission.instance.workload, 0.0)
    alone = np.where(kept, mission.appears + work / fastest, 0.0)
    return float(max(work.sum() / fastest, alone.max()))
