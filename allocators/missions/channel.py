"""The radio, compiled: see `alloc.problems.missions.simulation.channel`."""

import math
from collections.abc import Sequence

import numpy as np

from alloc.allocators.missions.chance import fraction, keyed
from alloc.allocators.missions.knowledge import Numbers, length
from alloc.allocators.missions.layout import IDLE, NOBODY, WORKING, Agent, Head, MissionArrays
from alloc.allocators.missions.motion import distance_between, place_of
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.fields import BoolArray, FloatArray, IntArray
from alloc.problems.missions.simulation.reports import BYTES_OF_AGENT, BYTES_OF_MESSAGE, BYTES_OF_TASK


@compiled_in_place
def is_silent(state: MissionArrays, number: int) -> bool:
    """Whether an agent can neither send nor hear now."""
    head = state.head[0]
    for place in range(head.silences):
        event = state.events[state.silences[place]]
        if head.hour >= event.until:
            continue
        if event.agent != NOBODY:
            if event.agent == number:
                return True
            continue
        here = place_of(state.agents[number], head.hour)
        if distance_between(head.is_manhattan, here, (event.x, event.y, event.z)) <= event.radius + TOLERANCE:
            return True
    return False


@compiled_in_place
def send_all(state: MissionArrays, slot: int) -> bool:
    """Send a message of each agent that can and will, all that it knows; return whether any is heard."""
    head, agents, speaks = state.head[0], state.agents, state.speaks
    for number in range(len(agents)):
        speaks[number] = state.visible[number] and agents[number].speaks != 0
        if speaks[number] and head.silences and is_silent(state, number):
            speaks[number] = False
        if speaks[number]:
            agents[number].messages += 1
            agents[number].bytes += BYTES_OF_MESSAGE
    heard = state.heard[slot]
    found = find_hearers(head, speaks, state.visible, state.places, heard)
    of_tasks = state.sent_task_hour[slot], state.sent_task_left[slot]
    keep(agents, speaks, state.task_hour, state.task_left, of_tasks[0], of_tasks[1], BYTES_OF_TASK)
    of_agents = state.sent_agent_hour[slot], state.sent_agent_report[slot]
    keep(agents, speaks, state.agent_hour, state.agent_report, of_agents[0], of_agents[1], BYTES_OF_AGENT)
    if head.has_burst and found:
        lose_in_bursts(head, heard, state.link_number, state.link_bad)
    head.tick += 1
    return found


@compiled_in_place
def keep(
    agents: Sequence[Agent],
    speaks: BoolArray,
    hour: FloatArray,
    known: FloatArray | Numbers,
    sent_hour: FloatArray,
    sent: FloatArray | Numbers,
    size: int,
) -> None:
    """Keep what agents send of tasks, or of agents, and count its bytes: `size` for each of which anything is known."""
    for number in range(len(speaks)):
        if speaks[number]:
            count = 0
            hours, values, sent_hours, sent_values = hour[number], known[number], sent_hour[number], sent[number]
            for one in range(len(hours)):
                sent_hours[one] = hours[one]
                sent_values[one] = values[one]
                count += hours[one] >= 0
            agents[number].bytes += size * count


@compiled_in_place
def find_hearers(head: Head, speaks: BoolArray, visible: BoolArray, places: FloatArray, heard: BoolArray) -> bool:
    """Fill in who will hear the message that each agent sends now; return whether there is anybody."""
    found = False
    loss, tick = head.loss, head.tick
    for sender in range(len(speaks)):
        hears = heard[sender]
        if not speaks[sender]:
            hears[:] = False
            continue
        find_near(head.is_manhattan, head.radius, places, sender, visible, hears)
        hears[sender] = False
        key = keyed(head.loss_key, sender)
        for number in range(len(hears)):
            if hears[number]:
                hears[number] = not (loss > 0 and fraction(keyed(keyed(key, number), tick)) < loss)
                found = found or hears[number]
    return found


@compiled_in_place
def find_near(
    is_manhattan: int, radius: float, places: FloatArray, sender: int, visible: BoolArray, is_near: BoolArray
) -> None:
    """Fill in which agents in the mission are within the radius of one of them."""
    at_x, at_y, at_z = places[0], places[1], places[2]
    x, y, z = at_x[sender], at_y[sender], at_z[sender]
    for number in range(len(is_near)):
        far = length(is_manhattan, at_x[number] - x, at_y[number] - y, at_z[number] - z) > radius + TOLERANCE
        is_near[number] = visible[number] & (not far)


@compiled_in_place
def lose_in_bursts(head: Head, heard: BoolArray, number: IntArray, bad: IntArray) -> None:
    """Lose messages of this tick by the state of each link."""
    for sender in range(len(heard)):
        for hearer in range(len(heard)):
            if heard[sender, hearer]:
                is_bad = is_link_bad(head, sender, hearer, number, bad)
                key = keyed(keyed(keyed(keyed(head.loss_key, sender), hearer), head.tick), 1)
                loss = head.burst_loss_bad if is_bad else head.burst_loss_good
                heard[sender, hearer] = fraction(key) >= loss


@compiled_in_place
def is_link_bad(head: Head, sender: int, hearer: int, number: IntArray, bad: IntArray) -> bool:
    """Whether a link is bad now; a Markov chain over all messages up to this one, whether sent or not."""
    key = keyed(keyed(head.burst_key, sender), hearer)
    share = head.burst_bad / (head.burst_good + head.burst_bad)
    is_bad = bad[sender, hearer]
    for step in range(number[sender, hearer] + 1, head.tick + 1):
        hours = head.period if step else np.inf
        forgotten = -math.expm1(-hours * (1 / head.burst_good + 1 / head.burst_bad))
        is_bad = int(fraction(keyed(key, step)) < share + (is_bad - share) * (1 - forgotten))
    number[sender, hearer], bad[sender, hearer] = head.tick, is_bad
    return bool(is_bad != 0)


@compiled_in_place
def deliver(state: MissionArrays, slot: int) -> None:
    """Let all hear what was sent to them."""
    head, heard = state.head[0], state.heard[slot]
    for number in range(len(state.agents)):
        is_there = IDLE <= state.agents[number].status <= WORKING
        if not is_there or (head.silences and is_silent(state, number)):
            heard[:, number] = False
    hear(heard, state.sent_task_hour[slot], state.sent_task_left[slot], state.task_hour, state.task_left)
    hear(heard, state.sent_agent_hour[slot], state.sent_agent_report[slot], state.agent_hour, state.agent_report)


@compiled_in_place
def hear(
    heard: BoolArray, told_hour: FloatArray, told: FloatArray | Numbers, hour: FloatArray, known: FloatArray | Numbers
) -> None:
    """Take over what is newer in messages than what is known of tasks, or of agents."""
    for sender in range(len(heard)):
        for number in range(len(heard)):
            if heard[sender, number]:
                take_over(told_hour[sender], told[sender], hour[number], known[number])


@compiled_in_place
def take_over(told_hour: FloatArray, told: FloatArray | Numbers, hour: FloatArray, known: FloatArray | Numbers) -> None:
    """Take over from one message what is newer than what one agent knows."""
    for one in range(len(hour)):
        if told_hour[one] > hour[one]:
            hour[one] = told_hour[one]
            known[one] = told[one]
