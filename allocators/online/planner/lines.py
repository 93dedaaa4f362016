"""A planner for programs in any language: a protocol in which each line of JSON is answered by one line."""

from collections.abc import Callable

from alloc.allocators.online.planner.plan import Plan
from alloc.allocators.online.planner.planner import MissionPlanner
from alloc.allocators.online.planner.saved import change_to_row, order_to_row
from alloc.problems.arguments import flag, real, shown, text
from alloc.problems.errors import AllocError, InputError, nearest
from alloc.problems.formats.json_columns import Row, require_known
from alloc.problems.formats.json_text import parse, require_object
from alloc.problems.formats.messages import message_line
from alloc.problems.missions.events import LATEST
from alloc.problems.missions.files.document import mission_from_document
from alloc.problems.missions.mission import Mission

REQUEST_FORMAT, ORDERS_FORMAT = "alloc-planner-request/1", "alloc-planner-orders/1"

REQUESTS = {"plan": ("hour",), "pin": ("agent", "task"), "unpin": ("agent",), "save": ()}
"""Fields of each kind of request other than events."""


class Lines:
    """Answers any line; for an invalid one, the answer is an error, and nothing changes.

    Parameters
    ----------
    planner : MissionPlanner or None
        None if the first valid line is to be the mission.
    begin : callable
        Returns the planner of a mission.
    state : str or None
        File to which the planner is saved.
    """

    def __init__(
        self, planner: MissionPlanner | None, begin: Callable[[Mission], MissionPlanner], state: str | None = None
    ) -> None:
        self._planner, self._begin, self._state = planner, begin, state

    def answer(self, line: str, number: int) -> Row:
        """Return the answer to a line: the whole plan and its changes, or an error.

        Parameters
        ----------
        line : str
        number : int
            Line number, from 1.
        """
        try:
            plan, error = self._do(require_object(parse(line))), None
        except AllocError as fault:
            plan, error = None, message_line(str(fault))
        hour = 0.0 if self._planner is None else self._planner.hour
        head: Row = {"format": ORDERS_FORMAT, "line": number, "hour": hour}
        if error is not None:
            return {**head, "error": error}
        if plan is None:
            return head
        return {
            **head,
            "is_new": plan.is_new,
            "problem": plan.problem,
            "orders": [{"agent": agent, **(order_to_row(order) or {})} for agent, order in plan.items()],
            "changes": [change_to_row(change) for change in plan.changes],
        }

    def save(self) -> None:
        """Save the planner, if there are a planner and a file."""
        if self._planner is not None and self._state is not None:
            self._planner.save(self._state)

    def close(self) -> None:
        """Close the planner."""
        if self._planner is not None:
            self._planner.close()

    def _do(self, row: Row) -> Plan | None:
        """Process a line and return the plan, or None if none is requested."""
        if self._planner is None:
            self._planner = self._begin(mission_from_document(row))
            return self._planner.plan()
        fields = {name: value for name, value in row.items() if name not in ("format", "plan")}
        wanted = flag(row.get("plan", True), "plan")
        if row.get("format", REQUEST_FORMAT) != REQUEST_FORMAT:
            raise InputError(f"must be {REQUEST_FORMAT}, got {shown(row['format'])}", "format")
        hour = None
        if "event" in fields:
            self._planner.submit(fields)
        elif "request" in fields:
            hour = self._request(self._planner, fields)
        else:
            raise InputError("is missing; give an event, or a request", "event")
        return self._planner.plan(hour) if wanted else None

    def _request(self, planner: MissionPlanner, fields: Row) -> float | None:
        """Process a request, and return the hour of the plan to be made."""
        name = text(fields.pop("request"), "request")
        if name not in REQUESTS:
            raise InputError(f"there is no request {shown(name)}{nearest(name, tuple(REQUESTS))}", "request")
        require_known(fields, REQUESTS[name], "")
        if name == "save":
            if self._state is None:
                raise InputError("needs a file: start with --state FILE", "request")
            self.save()
        elif name == "pin":
            if "task" not in fields:
                raise InputError("is missing; give an id, or null to stay", "task")
            planner.pin(text(fields.get("agent"), "agent"), fields.get("task"))  # type: ignore[arg-type]
        elif name == "unpin":
            planner.unpin(text(fields.get("agent"), "agent"))
        hour = fields.get("hour")
        return None if hour is None else real(hour, "hour", 0, LATEST)
