"""Simulation of missions under a policy; where it misses its deadline, the last orders stay in force."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from alloc.allocators.online.contract import AgentDecider, Briefing, FleetDecider, Policy, PolicyError, PolicyInfo
from alloc.allocators.online.registry import describe_policy, load_policy
from alloc.allocators.parallel.engine import never_stop
from alloc.problems import InputError, RefusedError
from alloc.problems.arguments import checked_seed, choice, of_type, real
from alloc.problems.missions.files.log_file import MissionLog
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.replay import log_of
from alloc.problems.missions.simulation.agenda import Request, Wanted
from alloc.problems.missions.simulation.measures import DecisionTimes, MissionResult, measured
from alloc.problems.missions.simulation.reports import Message, View
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import Order
from alloc.problems.vocabulary import Knowledge


@dataclass(frozen=True)
class MissionRun:
    """A finished mission.

    Attributes
    ----------
    result : MissionResult
    log : MissionLog
    """

    result: MissionResult
    log: MissionLog


def simulate(
    mission: Mission,
    policy: str | Policy,
    *,
    knowledge: Knowledge | str | None = None,
    seed: int = 0,
    deadline_ms: float | None = None,
    parameters: object = None,
    observe: Callable[[Simulation], None] | None = None,
    **settings: object,
) -> MissionRun:
    """Simulate a mission to its end under a policy.

    Parameters
    ----------
    mission : Mission
    policy : str or Policy
        A name, or a policy with its own parameters.
    knowledge : {"full", "local"}, optional
        What agents know; by default as the mission says.
    seed : int
        Seed of the policy and, together with the mission's seed, of message loss; from 0 to 2^63 - 1.
    deadline_ms : float, optional
        Time limit of each decision in milliseconds; a later answer is ignored, and the last orders stay in force.
    parameters : object, optional
        Parameters of a policy that is given by name.
    observe : callable, optional
        Called with the simulation before it begins, e.g. a `Recorder`.
    **settings
        Single parameters of a policy that is given by name.

    Returns
    -------
    MissionRun

    Raises
    ------
    InputError
        If the policy or a parameter is unknown, or an argument is invalid; the error's ``place`` is the parameter.
    RefusedError
        If the policy needs full knowledge and agents have only local knowledge.
    PolicyError
        If the policy returns something that is not an order.
    """
    run = simulate_until(
        never_stop, mission, policy, knowledge, seed, deadline_ms, parameters, observe=observe, **settings
    )
    assert run is not None
    return run


def simulate_until(
    should_stop: Callable[[], bool],
    mission: Mission,
    policy: str | Policy,
    knowledge: Knowledge | str | None = None,
    seed: int = 0,
    deadline_ms: float | None = None,
    parameters: object = None,
    observe: Callable[[Simulation], None] | None = None,
    **settings: object,
) -> MissionRun | None:
    """Simulate as `simulate` does, but stop and return None once `should_stop` returns True before a decision."""
    began = time.perf_counter()
    of_type(mission, Mission, "mission")
    of_type(policy, (str, Policy), "policy")
    known = mission.knowledge if knowledge is None else choice(Knowledge, knowledge, "knowledge")
    number = checked_seed(seed)
    deadline_s = None if deadline_ms is None else real(deadline_ms, "deadline_ms", above=True) / 1000
    if isinstance(policy, Policy) and (settings or parameters is not None):
        raise InputError("is an object with its own parameters; set them when you create it", "policy")
    require_knowledge(describe_policy(policy) if isinstance(policy, str) else policy.info, known)
    chosen = load_policy(policy, parameters, **settings) if isinstance(policy, str) else policy
    simulation = Simulation(mission, known, number)
    if observe is not None:
        observe(simulation)
    control = _Control(chosen, simulation, number, deadline_s)
    while (request := simulation.advance()) is not None:
        if should_stop():
            return None
        control.answer(request)
    times = DecisionTimes.of(control.seconds, control.late, time.perf_counter() - began)
    result = measured(simulation, chosen.info.name, number, times)
    return MissionRun(result, log_of(simulation, result))


def require_knowledge(policy: PolicyInfo, knowledge: Knowledge) -> None:
    """Raise an error if a policy needs full knowledge; called before loading it, which may compile for a minute.

    Parameters
    ----------
    policy : PolicyInfo
    knowledge : Knowledge

    Raises
    ------
    RefusedError
        If the policy is central and knowledge is local.
    """
    if policy.central and knowledge is Knowledge.LOCAL:
        raise RefusedError(f"policy {policy.name!r} leads all agents, and needs full knowledge (--knowledge full)")


class _Control:
    """Connects a policy to a simulation: hands over views and passes on orders that arrive in time.

    Attributes
    ----------
    seconds : list of float
        Duration of each decision.
    late : int
        Number of decisions after the deadline.
    """

    def __init__(self, policy: Policy, simulation: Simulation, seed: int, deadline_s: float | None) -> None:
        self._simulation, self._deadline_s = simulation, deadline_s
        self._name = policy.info.name
        self.seconds: list[float] = []
        self.late = 0
        mission, known = simulation.mission, simulation.knowledge
        self._fleet: FleetDecider | None = None
        self._agents: dict[str, AgentDecider] = {}
        if policy.info.central:
            told = policy.info.clairvoyant
            fleet = policy.begin(Briefing.of(mission, known, seed, deadline_s, None, clairvoyant=told))
            if not isinstance(fleet, FleetDecider):
                raise PolicyError(f"policy {self._name!r} is central, but began with a {type(fleet).__name__}")
            self._fleet = fleet
            return
        for name in mission.instance.agent_ids:
            decider = policy.begin(Briefing.of(mission, known, seed, deadline_s, name))
            if not isinstance(decider, AgentDecider):
                raise PolicyError(f"policy {self._name!r} is not central, but began with a {type(decider).__name__}")
            self._agents[name] = decider

    def answer(self, request: Request) -> None:
        """Send the policy's messages or give its orders, as the simulation requests."""
        if request.wanted is Wanted.MESSAGES:
            for name in () if self._fleet is not None else request.agents:
                self._send(name)
        elif self._fleet is not None:
            self._order_fleet(self._fleet, request)
        else:
            for name in request.agents:
                self._order(name)

    def _send(self, name: str) -> None:
        message = self._agents[name].message(self._simulation.view(name, is_glance=True))
        if message is None:
            return
        if not isinstance(message, Message) or message.sender != name:
            raise PolicyError(f"policy {self._name!r} sent {message!r} as a message of {name!r}")
        self._simulation.send(name, message)

    def _order_fleet(self, fleet: FleetDecider, request: Request) -> None:
        view = self._simulation.view(None)
        began = time.perf_counter()
        orders = fleet.decide(view)
        in_time = self._is_in_time(began)
        if not isinstance(orders, Mapping):
            raise PolicyError(f"policy {self._name!r} returned {type(orders).__name__}, not a mapping of orders")
        for name, order in orders.items():
            if name not in request.agents:
                raise PolicyError(f"policy {self._name!r} gave an order to {name!r}, which cannot take orders now")
            if in_time:
                self._give(name, order)

    def _order(self, name: str) -> None:
        view: View = self._simulation.view(name)
        began = time.perf_counter()
        order = self._agents[name].decide(view)
        if self._is_in_time(began) and order is not None:
            self._give(name, order)

    def _is_in_time(self, began: float) -> bool:
        seconds = time.perf_counter() - began
        self.seconds.append(seconds)
        is_late = self._deadline_s is not None and seconds > self._deadline_s
        self.late += is_late
        return not is_late

    def _give(self, name: str, order: Order) -> None:
        if not isinstance(order, Order):
            raise PolicyError(f"policy {self._name!r} returned {order!r}, which is not an Order")
        self._simulation.order(name, order)
