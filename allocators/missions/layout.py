"""The state of a compiled mission: records of agents and tasks, and arrays of what agents know."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.missions.records import Agent, Entry, Happening, Head, Report, Task
from alloc.problems.fields import BoolArray, FloatArray, IntArray

Numbers = NDArray[np.int32]

ABSENT, IDLE, FLYING, WORKING, AWAY, FAILED = range(6)
"""What an agent does, in the order of `AgentStatus`."""

TO_COME, OPEN, DONE, MISSED, CANCELLED = range(5)
"""What has become of a task, in the order of `TaskStatus`."""

STAY, TO_TASK, TO_PLACE = range(3)
"""What an order is: to stay, to go to a task, or to a place."""

OVER, MESSAGES, ORDERS = range(3)
"""What a mission waits for: nothing any more, messages to be sent, or orders."""

NOBODY = -1
"""No agent, no task; what is known of a closed task is minus its status instead of the work left."""


class MissionArrays(NamedTuple):
    """A mission as it goes on, for compiled code.

    Row r of what is known is that of agent r, or the only one where all know all. n agents, m tasks, k messages of each
    agent on the air at once at the most. Rows on tasks have columns behind these, of which nothing is known. Report 0
    is that of nobody: it stands where nothing is known of an agent.

    Attributes
    ----------
    head : records, shape (1,)
    agents, tasks : records, shape (n,) and (m,)
    events, agenda, reports : records
    renumbered : ndarray of int, shape (reports,)
        New numbers of reports, when those are dropped that nobody knows any more.
    allowed : ndarray of bool, shape (n, m)
        Which agent may do which task, by its list and its skills.
    area : ndarray, shape (2, 3)
        Least and largest coordinates of all places, which all know.
    sites : ndarray, shape (3, m)
        Where tasks are.
    task_now : ndarray, shape (m,)
        What can be seen of each task now: the work left, minus its status where it is closed, NaN where it is to come.
    places : ndarray, shape (3, n)
        Where agents are at the hour of the grid, in the order of `in_cells`.
    cells, in_cells : ndarray of int, shape (cells + 1,) and (n,)
        Agents by the cells of the grid, and where those of each cell begin.
    is_near : ndarray of bool, shape (n or m,)
        Which places are near another one, of agents by cells or of tasks; as many as there are of the more numerous.
    near : ndarray of int, shape (n or m,)
        The numbers of those that are.
    speaks : ndarray of bool, shape (n,)
        Who sends a message.
    speakers, speaker_places, speaker_cells : ndarray
        Those who do, where they are, and where those of each cell begin, as `in_cells`, `places` and `cells` of all.
    task_hour, task_left : ndarray, shape (rows, m)
        Hour at which an agent's knowledge of a task was true, -1 where it knows nothing, and the work left then.
    known, known_report : ndarray of int, shape (rows,) and (rows, n)
        Of how many agents an agent knows, and the number of the newest report of each.
    heard_of : ndarray of int, shape (rows, words)
        A bit for each agent of which an agent has ever known, where that may be forgotten.
    sent_task_hour, sent_task_left, sent, sent_report, sent_of : ndarray
        The same, as it was when it was sent, by message and agent.
    senders, first_sender, sender : ndarray of int, shape (k, n), (k, n) and (k, n * n)
        How many messages an agent hears, and who sent them: by number, from its first one on.
    links : ndarray of int, shape (n, n)
        State of each link, with losses in bursts: twice the number of messages up to one, and 1 if it was bad then.
    silences : ndarray of int
        Events by which there is silence.
    lookers, marked, deciding, changed_agents, changed_tasks : ndarray of int
        Agents that are to look around, that are to decide, and get orders now; what the agenda has to take notice of.
    """

    head: Sequence[Head]
    agents: Sequence[Agent]
    tasks: Sequence[Task]
    events: Sequence[Happening]
    agenda: Sequence[Entry]
    reports: Sequence[Report]
    renumbered: Numbers
    allowed: BoolArray
    area: FloatArray
    sites: FloatArray
    task_now: FloatArray
    places: FloatArray
    cells: Numbers
    in_cells: Numbers
    is_near: BoolArray
    near: Numbers
    speaks: BoolArray
    speakers: Numbers
    speaker_places: FloatArray
    speaker_cells: Numbers
    task_hour: FloatArray
    task_left: FloatArray
    known: Numbers
    known_report: Numbers
    heard_of: IntArray
    sent_task_hour: FloatArray
    sent_task_left: FloatArray
    sent: Numbers
    sent_report: Numbers
    sent_of: IntArray
    senders: Numbers
    first_sender: IntArray
    sender: Numbers
    links: Numbers
    silences: IntArray
    lookers: IntArray
    marked: IntArray
    deciding: IntArray
    changed_agents: IntArray
    changed_tasks: IntArray
