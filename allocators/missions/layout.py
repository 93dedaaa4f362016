"""The state of a compiled mission: records of agents and tasks, and arrays of what agents know."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.missions.records import Agent, Entry, Happening, Head, Report, Task
from alloc.problems.fields import BoolArray, FloatArray, IntArray

Numbers = NDArray[np.int32]

ABSENT, IDLE, FLYING, WORKING, AWAY, FAILED = range(6)
"""Status of an agent, in the order of `AgentStatus`."""

TO_COME, OPEN, DONE, MISSED, CANCELLED = range(5)
"""Status of a task, in the order of `TaskStatus`."""

STAY, TO_TASK, TO_PLACE = range(3)
"""Kinds of orders: stay, go to a task, go to a place."""

OVER, MESSAGES, ORDERS = range(3)
"""What a mission waits for: nothing, as it is over; messages; or orders."""

NOBODY = -1
"""No agent or no task. (The known work left of a closed task is minus its status.)"""


class MissionArrays(NamedTuple):
    """State of a mission for compiled code.

    There are n agents, m tasks and at most k messages of each agent in transit. Row r of a knowledge array is that of
    agent r; with full knowledge there is only one row. Rows with values of tasks are padded with columns of unknown
    tasks. Report 0 stands for no report of an agent.

    Attributes
    ----------
    head : records, shape (1,)
    agents, tasks : records, shape (n,) and (m,)
    events, agenda, reports : records
    renumbered : ndarray of int, shape (reports,)
        New numbers of reports, when reports that no agent knows any more are dropped.
    allowed : ndarray of bool, shape (n, m)
        Which agents may do which tasks, by lists and skills.
    area : ndarray, shape (2, 3)
        Smallest and largest coordinates of all places, which all agents know.
    sites : ndarray, shape (3, m)
        Positions of tasks.
    task_now : ndarray, shape (m,)
        Work left of each task now, minus its status if it is closed, NaN if it is still to come.
    places : ndarray, shape (3, n)
        Positions of agents at the hour of the grid, in the order of `in_cells`.
    cells, in_cells : ndarray of int, shape (cells + 1,) and (n,)
        Start of each cell of the grid in `in_cells`, and the agents sorted by cell.
    is_near : ndarray of bool, shape (max(n, m),)
        Scratch: whether each place, of agents by cell or of tasks, is near a given one.
    near : ndarray of int, shape (max(n, m),)
        Scratch: the indices of those that are.
    speaks : ndarray of bool, shape (n,)
        Whether each agent sends a message.
    speakers, speaker_places, speaker_cells : ndarray
        Agents that do, with the layout of `in_cells`, `places` and `cells`.
    task_hour, task_left : ndarray, shape (rows, m)
        Hour of an agent's knowledge of a task, -1 if unknown, and the work left at that hour.
    known, known_report : ndarray of int, shape (rows,) and (rows, n)
        Number of agents of which an agent knows, and the number of its newest report of each.
    heard_of : ndarray of int, shape (rows, words)
        A bit for each agent of which an agent has ever known, if old reports may be forgotten.
    sent_task_hour, sent_task_left, sent, sent_report, sent_of : ndarray
        Copies of these arrays when sent, by message and sender.
    senders, first_sender, sender : ndarray of int, shape (k, n), (k, n) and (k, n * n)
        Number of messages that an agent receives, the start of its part of `sender`, and the senders.
    links : ndarray of int, shape (n, n)
        State of each link, with burst losses: twice the number of messages up to the last update, plus 1 if it was bad.
    silences : ndarray of int
        Events with silences.
    lookers, marked, deciding, changed_agents, changed_tasks : ndarray of int
        Agents that are to sense, that are to decide, and that get orders now; agents and tasks to be rescheduled.
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
