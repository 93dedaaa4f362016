"""Text of the results of missions."""

from typing import TYPE_CHECKING

from alloc.cli.output.console import table
from alloc.problems.text import labelled, number, percent

if TYPE_CHECKING:
    from alloc.problems import MissionResult, Units
    from alloc.problems.missions.replay import Laws


def lines(result: "MissionResult", units: "Units") -> str:
    """Return the measures of one run, one per line."""
    time = labelled(number(result.mission_time), units.time)
    figures = [
        (f"{result.mission}, policy {result.policy}, {result.knowledge} knowledge, seed {result.seed}", ""),
        ("Mission time", time if result.is_done else "none, as not all tasks are done"),
        ("Lower bound", labelled(number(result.mission_time_lower_bound), units.time)),
        ("Tasks", f"{result.tasks_done} done, {result.tasks_missed} missed, {result.tasks_left} left"),
        ("Priority done", percent(result.priority_done_share)),
        ("From appearance to completion", _hours(result, units)),
        ("Energy", labelled(number(result.energy), units.energy)),
        ("Distance", f"{_distance(result, units)}, worst agent {number(result.distance_worst_agent)}"),
        ("Battery left", f"{number(result.battery_remaining_percent, 4)} %"),
        ("Switches", str(result.switches)),
        ("Messages", f"{result.messages}, {result.bytes} bytes, busiest agent {result.messages_busiest_agent}"),
        ("Decisions", _decisions(result)),
        ("Work given up", labelled(number(result.work_given_up), units.work)),
    ]
    if result.battery_remaining_percent is None:
        figures = [figure for figure in figures if figure[0] != "Battery left"]
    return "\n".join(f"{name}: {value}" if value else f"{name}:" for name, value in figures)


def _hours(result: "MissionResult", units: "Units") -> str:
    mean = labelled(number(result.completion_hours_mean), units.time)
    return f"mean {mean}, 95th percentile {labelled(number(result.completion_hours_p95), units.time)}"


def _distance(result: "MissionResult", units: "Units") -> str:
    return labelled(number(result.distance), units.distance)


def _decisions(result: "MissionResult") -> str:
    if not result.decisions:
        return "none"
    mean, worst = number(result.decision_ms_mean, 3), number(result.decision_ms_worst, 3)
    return f"{result.decisions}, mean {mean} ms, worst {worst} ms"


def rows(results: "list[MissionResult]") -> str:
    """Return a table with a row for each run."""
    header = ["seed", "status", "time", "done", "missed", "left", "energy", "switches", "messages"]
    return table(
        header,
        [
            [
                str(result.seed),
                result.status,
                number(result.mission_time),
                str(result.tasks_done),
                str(result.tasks_missed),
                str(result.tasks_left),
                number(result.energy),
                str(result.switches),
                str(result.messages),
            ]
            for result in results
        ],
        left=2,
    )


def law_lines(laws: "Laws", units: "Units") -> str:
    """Return the two sides of each conservation law that was verified."""

    def work(amount: float) -> str:
        return labelled(number(amount, 10), units.work)

    return (
        f"Work: {work(laws.work_appeared)} appeared or grew = {work(laws.work_done)} done + {work(laws.work_left)} left"
        f" + {work(laws.work_cancelled)} cancelled + {work(laws.work_missed)} missed\n"
        f"Energy: {number(laws.battery_lost, 10)} lost by batteries = {number(laws.battery_energy, 10)} flown\n"
        "All laws hold at every event, and every line of the log follows from the orders before it."
    )
