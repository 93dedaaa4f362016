"""Reports of agents, and which agents know them, compiled.

Reports are numbered chronologically. An agent's row has the number of its newest report of each agent, or `NOTHING`. So
the newer entries of two rows are given by their elementwise maximum, which is vectorised.
"""

import numpy as np

from alloc.allocators.missions.layout import NOBODY, TO_TASK, WORKING, MissionArrays, Numbers
from alloc.allocators.missions.motion import battery_of, distance_between, place_of
from alloc.allocators.missions.records import Agent, Report
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import IntArray

_ODD, _PAIRS = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
_FOURS, _BYTES = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0x0101010101010101)
_1, _2, _4, _56 = np.uint64(1), np.uint64(2), np.uint64(4), np.uint64(56)

NOTHING = 0
"""Number that stands for no report of an agent."""

SLACK = 1e-6
"""Share of the memory by which reports are kept longer, to allow for rounding errors."""


@inlined
def report_now(state: MissionArrays, agent: Agent) -> None:
    """Write a new report of an agent, for agents that sense now."""
    head = state.head[0]
    if agent.seen == head.hour:
        head.has_twins = 1
    agent.report, agent.reported, agent.seen = head.reports, head.looks, head.hour
    write_report(state, agent, state.reports[head.reports])
    head.reports += 1


@compiled_in_place
def write_report(state: MissionArrays, agent: Agent, report: Report) -> None:
    """Write a report of an agent."""
    head = state.head[0]
    here = place_of(agent, head.hour)
    report.hour, report.status = head.hour, agent.status
    report.x, report.y, report.z = here
    report.battery = battery_of(agent, head.hour)
    report.task, report.arrives = NOBODY, -np.inf
    if agent.order == TO_TASK:
        report.task = agent.order_task
        if agent.status != WORKING:
            to = state.tasks[agent.order_task]
            way = distance_between(head.is_manhattan, here, (to.x, to.y, to.z))
            report.arrives = head.hour + way / agent.speed


@inlined
def learn(state: MissionArrays, row: int, agent: int, report: int) -> None:
    """Replace the last known report of an agent in a row."""
    if state.known_report[row, agent] == NOTHING:
        state.known[row] += 1
        if state.heard_of.shape[1]:
            state.heard_of[row, agent >> 6] |= 1 << (agent & 63)
    state.known_report[row, agent] = report


@inlined
def hear_of_agents(state: MissionArrays, slot: int, number: int) -> None:
    """Let an agent adopt newer reports of agents from the messages that it receives."""
    head, known, first = state.head[0], state.known_report[number], state.first_sender[slot, number]
    for place in range(first, first + state.senders[slot, number]):
        sender = state.sender[slot, place]
        told = state.sent_report[slot, sender]
        if head.has_twins:
            for agent in range(len(known)):
                if is_newer(state, told[agent], known[agent]):
                    known[agent] = told[agent]
        else:
            take_newer(told, known)
        for word in range(state.heard_of.shape[1]):
            state.heard_of[number, word] |= state.sent_of[slot, sender, word]
    state.known[number] = keep_recent(known, head.oldest, known)


@inlined
def is_newer(state: MissionArrays, told: int, known: int) -> bool:
    """Whether a report is newer than another of the same agent, which may be from the same hour."""
    return told > known and (known == NOTHING or state.reports[told].hour > state.reports[known].hour)


@compiled_in_place
def take_newer(told: Numbers, known: Numbers) -> None:
    """Adopt newer reports of the same agents, i.e. those with higher numbers."""
    for agent in range(len(known)):
        known[agent] = max(known[agent], told[agent])


@compiled_in_place
def keep_recent(known: Numbers, oldest: int, kept: Numbers) -> int:
    """Copy a row without old reports; return the number of reports left."""
    count = 0
    for agent in range(len(kept)):
        report = known[agent] if known[agent] >= oldest else NOTHING
        kept[agent] = report
        count += report != NOTHING
    return count


@compiled_in_place
def find_oldest(state: MissionArrays) -> None:
    """Find the first report that is recent enough to be kept."""
    head = state.head[0]
    since = head.hour - head.memory * (1 + SLACK)
    while head.oldest < head.reports and state.reports[head.oldest].hour < since:
        head.oldest += 1


@compiled_in_place
def drop_unknown(state: MissionArrays) -> None:
    """Make room for reports by dropping those that no agent knows any more."""
    head, number = state.head[0], state.renumbered
    find_oldest(state)
    number[: head.reports] = NOBODY
    number[NOTHING] = NOTHING
    for row in range(len(state.known)):
        state.known[row] = mark(state.known_report[row], head.oldest, number)
    for slot in range(len(state.sent)):
        for row in range(len(state.agents)):
            if state.sent[slot, row]:
                state.sent[slot, row] = mark(state.sent_report[slot, row], head.oldest, number)
    kept = keep_marked(state)
    if kept + len(state.agents) > len(number):
        raise OverflowError("a compiled mission has no room for what agents know")
    head.reports, head.oldest = kept, 0
    head.limit = min(len(number), max(head.limit, 2 * (kept + len(state.agents))))
    for row in range(len(state.known)):
        renumber(state.known_report[row], number)
    for slot in range(len(state.sent)):
        for row in range(len(state.agents)):
            if state.sent[slot, row]:
                renumber(state.sent_report[slot, row], number)


@inlined
def mark(known: Numbers, oldest: int, number: Numbers) -> int:
    """Mark the reports of a row for keeping, and drop old ones; return the number of reports left."""
    kept = keep_recent(known, oldest, known)
    for agent in range(len(known)):
        number[known[agent]] = 0
    return kept


@compiled_in_place
def keep_marked(state: MissionArrays) -> int:
    """Renumber all marked reports; return their number."""
    number, kept = state.renumbered, 0
    for place in range(state.head[0].reports):
        if number[place] != NOBODY:
            number[place] = kept
            if kept != place:
                copy(state.reports[place], state.reports[kept])
            kept += 1
    return kept


@compiled_in_place
def copy(one: Report, other: Report) -> None:
    """Copy a report."""
    other.hour, other.status, other.task = one.hour, one.status, one.task
    other.arrives, other.battery = one.arrives, one.battery
    other.x, other.y, other.z = one.x, one.y, one.z


@compiled_in_place
def renumber(known: Numbers, number: Numbers) -> None:
    """Replace numbers of reports by new ones."""
    for place in range(len(known)):
        known[place] = number[known[place]]


@compiled_in_place
def count_known(known: int, heard_of: IntArray) -> int:
    """Return of how many agents anything was ever known: by the bits of `heard_of` if these are kept."""
    if len(heard_of) == 0:
        return known
    count = np.uint64(0)
    for word in range(len(heard_of)):
        bits = np.uint64(heard_of[word])
        bits -= (bits >> _1) & _ODD
        bits = (bits & _PAIRS) + ((bits >> _2) & _PAIRS)
        count += (((bits + (bits >> _4)) & _FOURS) * _BYTES) >> _56
    return int(count)
