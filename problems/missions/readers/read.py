"""Import of a mission from a third-party file, by the name of its format."""

from collections.abc import Callable
from pathlib import Path

from alloc.problems.arguments import checked_seed, choice, of_type
from alloc.problems.errors import InputError, MissingPackageError
from alloc.problems.formats.files import PathLike, named
from alloc.problems.formats.messages import told
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.readers.cfstp import read_cfstp
from alloc.problems.missions.readers.london import read_london
from alloc.problems.missions.readers.new_brunswick import read_new_brunswick
from alloc.problems.missions.readers.options import RecordOptions
from alloc.problems.missions.readers.records import Records, mission_of_records
from alloc.problems.missions.readers.space import read_space
from alloc.problems.vocabulary import ForeignFormat

RECORDS: dict[ForeignFormat, Callable[[str, RecordOptions], Records]] = {
    ForeignFormat.LONDON: read_london,
    ForeignFormat.NEW_BRUNSWICK: read_new_brunswick,
}
DRAWN: dict[ForeignFormat, Callable[[str, str, int], Mission]] = {
    ForeignFormat.CFSTP: read_cfstp,
    ForeignFormat.SPACE: read_space,
}


def import_mission(
    file_format: ForeignFormat | str,
    path: PathLike,
    options: RecordOptions | None = None,
    *,
    seed: int = 0,
    name: str | None = None,
    report: Callable[[str], None] | None = None,
) -> Mission:
    """Import a mission from a third-party file, which the user has to provide.

    Parameters
    ----------
    file_format : {"cfstp", "space", "london", "new-brunswick"}
        An instance as printed by the tests of lcpz/cfstp; a configuration of the SPACE simulator; animal rescues of the
        London Fire Brigade; forest fires in New Brunswick.
    path : str or path
    options : RecordOptions, optional
        For the last two formats: fleet, days, compression of time.
    seed : int
        Seed of everything random that the file does not fix.
    name : str, optional
        Name of the mission; by default that of the file.
    report : callable, optional
        Called with a line of text for everything that was left out or filled in.

    Returns
    -------
    Mission

    Raises
    ------
    InputError
        If the file cannot be read, or the format does not take the given options.
    MissingPackageError
        If PyYAML is needed and not installed.
    """
    kind, number = choice(ForeignFormat, file_format, "file_format"), checked_seed(seed)
    called, source = name or Path(path).stem or str(kind), str(path)
    if kind in DRAWN:
        if options is not None:
            raise InputError(f"are for records, not for {kind}", "options")
        try:
            return DRAWN[kind](source, called, number)
        except MissingPackageError:
            raise
        except InputError as error:
            raise told(error, named(path)) from error.__cause__
    wanted = RecordOptions() if options is None else of_type(options, RecordOptions, "options")
    if wanted.fleet is not None and kind is not ForeignFormat.LONDON:
        raise InputError(f"is for {ForeignFormat.LONDON}, not for {kind}", "fleet")
    found = RECORDS[kind](source, wanted)
    if report is not None:
        for note in found.notes:
            report(note)
    return mission_of_records(found, wanted, called, number)
