"""Detection of all faults in a mission's document, where reading it would stop at the first."""

import re

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import AGENT_FIELDS, DEFAULT_NAME, TASK_FIELDS
from alloc.problems.formats.json_columns import Row
from alloc.problems.formats.json_text import RepeatedKey
from alloc.problems.missions.files.document import (
    HOURS_OF_AGENT,
    HOURS_OF_TASK,
    MISSION_FIELDS,
    mission_from_document,
)
from alloc.problems.missions.mission import Mission

MAX_FAULTS = 20

KNOWN = {"agents": (*AGENT_FIELDS, *HOURS_OF_AGENT), "tasks": (*TASK_FIELDS, *HOURS_OF_TASK)}


def mission_faults(document: object, *, default_name: str = DEFAULT_NAME) -> tuple[Mission | None, list[InputError]]:
    """Return the mission in a document, or one error for each fault.

    After each fault, the document is read again without the faulty part: an event, or a field of an agent, a task or
    the mission. Errors that may be mere consequences are not reported, and the search ends at a fault elsewhere.

    Parameters
    ----------
    document : dict
        As returned by `json.load`.
    default_name : str
        Name of the mission if the document gives none.

    Returns
    -------
    mission : Mission or None
    faults : list of InputError
        At most `MAX_FAULTS`.
    """
    repair, faults = _Repair(document), list[InputError]()
    while len(faults) < MAX_FAULTS:
        try:
            mission = mission_from_document(repair.document, default_name=default_name)
        except InputError as error:
            if not repair.is_consequence(error):
                faults.append(InputError(error.message, repair.place(error.place)))
            if not repair.leave_out(error.place):
                break
        else:
            return (None, faults) if faults else (mission, [])
    return None, faults


class _Repair:
    """A document from which faulty parts are removed one by one.

    Attributes
    ----------
    document : object
        What remains; the original document is not modified.
    """

    def __init__(self, document: object) -> None:
        self.document = document
        events = document.get("events") if isinstance(document, dict) else None
        self._kept = list(range(len(events))) if isinstance(events, list) else []
        self._is_event_gone = False

    def place(self, place: str) -> str:
        """Return the place in the original document."""
        row = re.match(r"events\[(\d+)\]", place)
        return place if row is None else f"events[{self._kept[int(row[1])]}]{place[row.end() :]}"

    def is_consequence(self, error: InputError) -> bool:
        """Whether an error about an event may be a consequence of the removal of another event."""
        is_sequence = re.fullmatch(r"events\[\d+\]", error.place) is not None and " to be " in error.message
        return self._is_event_gone and (is_sequence or error.message.startswith("there is no "))

    def leave_out(self, place: str) -> bool:
        """Remove the faulty part; return whether that is possible."""
        if not isinstance(self.document, dict):
            return False
        before = self.document
        row = re.match(r"(events|agents|tasks)\[(\d+)\](?:\.(\w+))?", place)
        if row is not None:
            return self._leave_row_out(before, row[1], int(row[2]), row[3])
        name = re.split(r"[.\[]", place)[0]
        if not name:  # an unknown or a repeated field
            known = {key: value for key, value in before.items() if key in MISSION_FIELDS}
            self.document = known
            return len(known) < len(before) or isinstance(before, RepeatedKey)
        if name not in before or name in ("format", "agents", "tasks", "bases", "distances"):
            return False
        self.document = {key: value for key, value in before.items() if key != name}
        return True

    def _leave_row_out(self, before: Row, kind: str, number: int, field: str | None) -> bool:
        rows = before[kind]
        assert isinstance(rows, list)
        if kind == "events":
            self.document = {**before, "events": rows[:number] + rows[number + 1 :]}
            del self._kept[number]
            self._is_event_gone = True
            return True
        old = rows[number]
        if not isinstance(old, dict) or field == "id":
            return False
        new = {name: value for name, value in old.items() if name in KNOWN[kind] and name != field}
        new.setdefault("ability" if kind == "agents" else "workload", 1.0)  # required
        self.document = {**before, kind: [*rows[:number], new, *rows[number + 1 :]]}
        return new != old or isinstance(old, RepeatedKey)
