"""Problem model: instances, allocations, missions, their files, and evaluation; independent of `alloc.allocators`.

Public names are imported on first access, so that `alloc.problems.vocabulary` can be used without loading numpy.
"""

import logging
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from alloc.problems.allocation import Allocation
    from alloc.problems.bounds import energy_lower_bound, lp_makespan_lower_bound, makespan_lower_bound
    from alloc.problems.classes import AgentClasses, agent_classes, count_classes
    from alloc.problems.distances.given import DistanceTable
    from alloc.problems.distances.reach import Reach
    from alloc.problems.errors import AllocError, InputError, MissingPackageError, RefusedError, TrainingError
    from alloc.problems.evaluation import Evaluation, Violation, evaluate
    from alloc.problems.formats.allocation_file import read_allocation, write_allocation
    from alloc.problems.formats.instance_file import read_instance, write_instance
    from alloc.problems.formats.model_file import write_model
    from alloc.problems.generate.covering import machine_covering
    from alloc.problems.generate.family import Family
    from alloc.problems.generate.paper_scenarios import paper, paper_like
    from alloc.problems.generate.random_family import random_instance
    from alloc.problems.instance import Instance
    from alloc.problems.matching.serving import only_allowed, serve_all
    from alloc.problems.matching.shortage import Shortage, find_shortage
    from alloc.problems.matching.unservable import fewest_unserved, minimal_unservable_set
    from alloc.problems.missions.course import Course
    from alloc.problems.missions.events import Event
    from alloc.problems.missions.families.cfstp import random_cfstp
    from alloc.problems.missions.families.draw import random_mission
    from alloc.problems.missions.families.parameters import MissionParameters
    from alloc.problems.missions.files.log_file import MissionLog, read_log, write_log
    from alloc.problems.missions.files.mission_file import read_mission, write_mission
    from alloc.problems.missions.mission import Mission
    from alloc.problems.missions.radio import Burst, Pace, Radio
    from alloc.problems.missions.readers.options import RecordOptions
    from alloc.problems.missions.readers.read import import_mission
    from alloc.problems.missions.recorder import Recorder, course_of
    from alloc.problems.missions.replay import replay
    from alloc.problems.missions.simulation.measures import MissionResult
    from alloc.problems.missions.snapshot import snapshot_at
    from alloc.problems.units import Units
    from alloc.problems.vocabulary import IDLE, Objective

__all__ = [
    "IDLE",
    "AgentClasses",
    "AllocError",
    "Allocation",
    "Burst",
    "Course",
    "DistanceTable",
    "Evaluation",
    "Event",
    "Family",
    "InputError",
    "Instance",
    "MissingPackageError",
    "Mission",
    "MissionLog",
    "MissionParameters",
    "MissionResult",
    "Objective",
    "Pace",
    "Radio",
    "Reach",
    "RecordOptions",
    "Recorder",
    "RefusedError",
    "Shortage",
    "TrainingError",
    "Units",
    "Violation",
    "agent_classes",
    "count_classes",
    "course_of",
    "energy_lower_bound",
    "evaluate",
    "fewest_unserved",
    "find_shortage",
    "import_mission",
    "lp_makespan_lower_bound",
    "machine_covering",
    "makespan_lower_bound",
    "minimal_unservable_set",
    "only_allowed",
    "paper",
    "paper_like",
    "random_cfstp",
    "random_instance",
    "random_mission",
    "read_allocation",
    "read_instance",
    "read_log",
    "read_mission",
    "replay",
    "serve_all",
    "snapshot_at",
    "write_allocation",
    "write_instance",
    "write_log",
    "write_mission",
    "write_model",
]

_MODULE_OF = {
    "AgentClasses": "classes",
    "AllocError": "errors",
    "Allocation": "allocation",
    "Burst": "missions.radio",
    "Course": "missions.course",
    "DistanceTable": "distances.given",
    "Evaluation": "evaluation",
    "Event": "missions.events",
    "Family": "generate.family",
    "IDLE": "vocabulary",
    "InputError": "errors",
    "Instance": "instance",
    "MissingPackageError": "errors",
    "Mission": "missions.mission",
    "MissionLog": "missions.files.log_file",
    "MissionParameters": "missions.families.parameters",
    "MissionResult": "missions.simulation.measures",
    "Objective": "vocabulary",
    "Pace": "missions.radio",
    "Radio": "missions.radio",
    "Reach": "distances.reach",
    "RecordOptions": "missions.readers.options",
    "Recorder": "missions.recorder",
    "RefusedError": "errors",
    "Shortage": "matching.shortage",
    "TrainingError": "errors",
    "Units": "units",
    "Violation": "evaluation",
    "agent_classes": "classes",
    "count_classes": "classes",
    "course_of": "missions.recorder",
    "energy_lower_bound": "bounds",
    "evaluate": "evaluation",
    "fewest_unserved": "matching.unservable",
    "find_shortage": "matching.shortage",
    "import_mission": "missions.readers.read",
    "lp_makespan_lower_bound": "bounds",
    "machine_covering": "generate.covering",
    "makespan_lower_bound": "bounds",
    "minimal_unservable_set": "matching.unservable",
    "only_allowed": "matching.serving",
    "paper": "generate.paper_scenarios",
    "paper_like": "generate.paper_scenarios",
    "random_cfstp": "missions.families.cfstp",
    "random_instance": "generate.random_family",
    "random_mission": "missions.families.draw",
    "read_allocation": "formats.allocation_file",
    "read_instance": "formats.instance_file",
    "read_log": "missions.files.log_file",
    "read_mission": "missions.files.mission_file",
    "replay": "missions.replay",
    "serve_all": "matching.serving",
    "snapshot_at": "missions.snapshot",
    "write_allocation": "formats.allocation_file",
    "write_instance": "formats.instance_file",
    "write_log": "missions.files.log_file",
    "write_mission": "missions.files.mission_file",
    "write_model": "formats.model_file",
}
"""Module that defines each public name; the imports above declare the same for type checkers."""

logging.getLogger("alloc").addHandler(logging.NullHandler())  # silent by default, as libraries should be


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
