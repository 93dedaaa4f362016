"""Reports of agents, and who knows which, compiled.

Reports are numbered in the order of time. An agent knows the newest one that it saw or heard of each other agent, or of
few of these: its row has as many of them as it knows, in the order of the numbers of agents.
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

SLACK = 1e-6
"""Part of the memory by which knowledge is kept longer, as hours are rounded."""


@compiled_in_place
def report_now(state: MissionArrays, agent: Agent) -> None:
    """Write another report of an agent, for those who look around now."""
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
    report.hour, report.status, report.ability = head.hour, agent.status, agent.ability
    report.x, report.y, report.z = here
    report.battery = battery_of(agent, head.hour)
    report.task, report.arrives = NOBODY, -np.inf
    if agent.order == TO_TASK:
        report.task = agent.order_task
        if agent.status != WORKING:
            to = state.tasks[agent.order_task]
            way = distance_between(head.is_manhattan, here, (to.x, to.y, to.z))
            report.arrives = head.hour + way / agent.speed


@compiled_in_place
def learn(state: MissionArrays, row: int, agent: int, report: int) -> None:
    """Let the last report of an agent that is known in a row be another one."""
    who, count = state.known_agent[row], state.known[row]
    place = find(who, count, agent)
    if place == count or who[place] != agent:
        known = state.known_report[row]
        for at in range(count, place, -1):
            who[at], known[at] = who[at - 1], known[at - 1]
        who[place] = agent
        state.known[row] = count + 1
        if state.heard_of.shape[1]:
            state.heard_of[row, agent >> 6] |= 1 << (agent & 63)
    state.known_report[row, place] = report


@inlined
def find(who: Numbers, count: int, agent: int) -> int:
    """Return the place of an agent in a row, or where it is to be inserted."""
    if agent < count and who[agent] == agent:  # all before it are known
        return agent
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if who[middle] < agent:
            low = middle + 1
        else:
            high = middle
    return low


@compiled_in_place
def hear_of_agents(state: MissionArrays, slot: int, number: int) -> None:
    """Let an agent take over what is newer in the messages that it hears than what it knows of agents."""
    head, newest = state.head[0], state.newest
    who, known, count = state.known_agent[number], state.known_report[number], state.known[number]
    for place in range(count):
        newest[who[place]] = known[place]
    first = state.first_sender[slot, number]
    for place in range(first, first + state.senders[slot, number]):
        sender = state.sender[slot, place]
        sent, told, told_of = state.sent[slot, sender], state.sent_report[slot, sender], state.sent_agent[slot, sender]
        if head.has_twins:
            for at in range(sent):
                if is_newer(state, told[at], newest[told_of[at]]):
                    newest[told_of[at]] = told[at]
        else:
            for at in range(sent):
                newest[told_of[at]] = max(newest[told_of[at]], told[at])
        for word in range(state.heard_of.shape[1]):
            state.heard_of[number, word] |= state.sent_of[slot, sender, word]
    state.known[number] = gather(newest, who, known, head.oldest)


@inlined
def is_newer(state: MissionArrays, told: int, known: int) -> bool:
    """Whether a report is newer than another of the same agent, which may be from the same hour."""
    return told > known and (known == NOBODY or state.reports[told].hour > state.reports[known].hour)


@compiled_in_place
def gather(newest: Numbers, who: Numbers, known: Numbers, oldest: int) -> int:
    """Fill a row with the newest reports of agents, but for old ones; return how many there are."""
    count = 0
    for agent in range(len(newest)):
        report = newest[agent]
        newest[agent] = NOBODY
        who[count], known[count] = agent, report
        count += report >= oldest
    return count


@compiled_in_place
def keep_recent(who: Numbers, known: Numbers, count: int, oldest: int, to_who: Numbers, to_known: Numbers) -> int:
    """Copy a row but for old reports; return how many are left."""
    kept = 0
    for place in range(count):
        report = known[place]
        to_who[kept], to_known[kept] = who[place], report
        kept += report >= oldest
    return kept


@compiled_in_place
def find_oldest(state: MissionArrays) -> None:
    """Find the first report that is recent enough to count."""
    head = state.head[0]
    since = head.hour - head.memory * (1 + SLACK)
    while head.oldest < head.reports and state.reports[head.oldest].hour < since:
        head.oldest += 1


@compiled_in_place
def drop_unknown(state: MissionArrays) -> None:
    """Make room where no more reports can be kept: drop those that nobody knows any more."""
    head, number = state.head[0], state.renumbered
    find_oldest(state)
    number[: head.reports] = NOBODY
    for row in range(len(state.known)):
        who, known = state.known_agent[row], state.known_report[row]
        state.known[row] = mark(who, known, state.known[row], head.oldest, number)
    for slot in range(len(state.sent)):
        for row in range(len(state.agents)):
            who, known = state.sent_agent[slot, row], state.sent_report[slot, row]
            state.sent[slot, row] = mark(who, known, state.sent[slot, row], head.oldest, number)
    kept = keep_marked(state)
    if kept + len(state.agents) > len(number):
        raise OverflowError("a compiled mission has no room for what agents know")
    head.reports, head.oldest = kept, 0
    head.limit = min(len(number), max(head.limit, 2 * (kept + len(state.agents))))
    for row in range(len(state.known)):
        renumber(state.known_report[row, : state.known[row]], number)
    for slot in range(len(state.sent)):
        for row in range(len(state.agents)):
            renumber(state.sent_report[slot, row, : state.sent[slot, row]], number)


@inlined
def mark(who: Numbers, known: Numbers, count: int, oldest: int, number: Numbers) -> int:
    """Mark the reports of a row that are to be kept, and drop old ones; return how many are left."""
    kept = keep_recent(who, known, count, oldest, who, known)
    for place in range(kept):
        number[known[place]] = 0
    return kept


@compiled_in_place
def keep_marked(state: MissionArrays) -> int:
    """Give new numbers to all reports that are marked; return how many there are."""
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
    other.arrives, other.ability, other.battery = one.arrives, one.ability, one.battery
    other.x, other.y, other.z = one.x, one.y, one.z


@compiled_in_place
def renumber(known: Numbers, number: Numbers) -> None:
    """Replace numbers of reports by new ones."""
    for place in range(len(known)):
        known[place] = number[known[place]]


@compiled_in_place
def count_known(known: int, heard_of: IntArray) -> int:
    """Return of how many agents anything was ever known: those that are, or those of whom bits say so."""
    if len(heard_of) == 0:
        return known
    count = np.uint64(0)
    for word in range(len(heard_of)):
        bits = np.uint64(heard_of[word])
        bits -= (bits >> _1) & _ODD
        bits = (bits & _PAIRS) + ((bits >> _2) & _PAIRS)
        count += (((bits + (bits >> _4)) & _FOURS) * _BYTES) >> _56
    return int(count)
