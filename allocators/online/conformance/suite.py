"""The conformance tests of policies as a class."""

from typing import ClassVar

import pytest

from alloc.allocators.online.conformance import cases
from alloc.allocators.online.contract import AgentDecider, Briefing, FleetDecider, Policy
from alloc.allocators.online.registry import load_policy
from alloc.allocators.online.run import MissionRun, simulate
from alloc.problems import Mission
from alloc.problems.missions.replay import replay
from alloc.problems.vocabulary import Knowledge, MissionFamily

Orders = list[tuple[object, ...]]


class PolicyConformance:
    """Tests of the `Policy` contract; subclass it as ``class TestMine(PolicyConformance)``.

    The subclass sets `name` or overrides `policy`.

    Attributes
    ----------
    name : str
        Name of the policy to load; not needed if `policy` is overridden.
    settings : dict
        Parameters of the policy; choose them so that its orders do not depend on the clock.
    deadline_ms : float
        Limit on the mean time of a decision in milliseconds, in missions of 3 agents.
    """

    name: ClassVar[str] = ""
    settings: ClassVar[dict[str, object]] = {}
    deadline_ms: ClassVar[float] = 100.0

    def policy(self) -> Policy:
        """Return a new policy."""
        return load_policy(self.name, **self.settings)

    def knowledge(self) -> Knowledge:
        """Return the least knowledge that the policy works with."""
        return Knowledge.FULL if self.policy().info.central else Knowledge.LOCAL

    def run(self, mission: Mission, policy: Policy | None = None) -> MissionRun:
        """Simulate a mission under the policy."""
        return simulate(mission, self.policy() if policy is None else policy, seed=1)

    def test_it_describes_itself(self) -> None:
        """Its name has lower-case letters, digits and hyphens, its summary one line."""
        info = self.policy().info
        assert info.name
        assert set(info.name) <= set("abcdefghijklmnopqrstuvwxyz0123456789-")
        assert info.summary
        assert "\n" not in info.summary

    def test_it_begins_as_it_says(self) -> None:
        """The decider decides for one agent, or for all agents if the policy is central."""
        policy, mission = self.policy(), cases.case(MissionFamily.STEADY, Knowledge.FULL)
        agent = None if policy.info.central else "a1"
        decider = policy.begin(
            Briefing.of(mission, Knowledge.FULL, 0, None, agent, clairvoyant=policy.info.clairvoyant)
        )
        assert isinstance(decider, FleetDecider if policy.info.central else AgentDecider)

    @pytest.mark.parametrize("family", cases.FAMILIES)
    def test_its_orders_can_be_followed(self, family: MissionFamily) -> None:
        """No order is refused: for an unknown or closed task, out of range, or beyond the battery."""
        run = self.run(cases.case(family, self.knowledge()))
        assert [record for record in run.log.records if record["record"] == "refused"] == []
        assert replay(run.log)[0] == run.result

    def test_nobody_is_sent_beyond_its_battery(self) -> None:
        """Where batteries last only for the nearest tasks, agents are sent to no other."""
        run = self.run(cases.short_of_energy(self.knowledge()))
        assert [record for record in run.log.records if record["record"] == "refused"] == []

    def test_the_same_seed_gives_the_same_orders(self) -> None:
        """Its orders depend only on the seed and on what it knows, also when the object is used again."""
        mission, policy = cases.case(MissionFamily.STEADY, self.knowledge()), self.policy()
        first = self.run(mission, policy).log.records
        assert self.run(mission, policy).log.records == first
        assert self.run(mission).log.records == first

    def test_it_answers_in_time(self) -> None:
        """Decisions meet the deadline on average, in a second run: the first one may still load and compile."""
        mission = cases.short_of_energy(self.knowledge(), horizon=1.0)
        self.run(mission)
        result = self.run(mission).result
        assert result.decision_ms_mean is not None
        assert result.decision_ms_mean <= self.deadline_ms

    def test_it_knows_nothing_of_the_future(self) -> None:
        """In two missions that differ only from some hour on, its orders and messages before that hour are the same.

        Clairvoyant policies are exempt.
        """
        if self.policy().info.clairvoyant:
            return
        one, other = (self.told(self.run(mission), cases.CHANGE) for mission in cases.futures(self.knowledge()))
        assert one == other

    def test_an_agent_knows_only_what_it_saw_and_heard(self) -> None:
        """A task far from all agents changes none of their orders before one of them can have seen it."""
        if self.policy().info.central:
            return
        one, other = (self.told(self.run(mission), cases.HIDDEN_UNTIL) for mission in cases.hidden())
        assert one == other

    def test_agents_share_nothing_but_messages(self) -> None:
        """Orders are the same if each agent has its own policy object."""
        if self.policy().info.central:
            return
        mission, suite = cases.case(MissionFamily.STEADY, Knowledge.LOCAL), self

        class Separate(Policy):
            info = self.policy().info

            def __init__(self) -> None:
                """Take no parameters."""

            def begin(self, briefing: Briefing) -> AgentDecider | FleetDecider:
                return suite.policy().begin(briefing)

        assert self.run(mission, Separate()).log.records == self.run(mission).log.records

    def told(self, run: MissionRun, until: float) -> Orders:
        """Return the orders and messages before hour `until`."""
        kinds = ("order", "refused", "message")
        records = (record for record in run.log.records if record["record"] in kinds)
        return [tuple(sorted(map(repr, record.items()))) for record in records if float(str(record["hour"])) < until]
