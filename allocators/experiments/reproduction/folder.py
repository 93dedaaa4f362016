"""The folder of a reproduction: rows, manifest, figures, and the page that is made from them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from alloc.allocators.experiments.reproduction.manifest import note_environment, read_manifest
from alloc.allocators.experiments.reproduction.protocol import Job, expected
from alloc.allocators.experiments.reproduction.rows import Learned, Row, Solved, append, begin, read
from alloc.allocators.parallel.engine import Engine, never_stop
from alloc.problems import InputError
from alloc.problems.formats import write_bytes_atomically

PAGE = "reproduction.md"


@dataclass(frozen=True)
class Folder:
    """Where everything is: the page in `path`, all else in a folder beside it, so that both may lie among other pages.

    Attributes
    ----------
    path : Path
    """

    path: Path

    @property
    def page(self) -> Path:
        """The page."""
        return self.path / PAGE

    @property
    def data(self) -> Path:
        """The folder of rows, manifest and figures."""
        return self.path / "reproduction"

    @property
    def learned(self) -> list[Learned]:
        """Rows of the methods that learn."""
        return whole_runs(
            read(self.data / "learning.csv", Learned),
            lambda row: Job(row.run, row.method, iterations=row.iterations),
            lambda row: (row.scenario, row.iteration),
        )

    @property
    def solved(self) -> list[Solved]:
        """Rows of the others."""
        return whole_runs(
            read(self.data / "others.csv", Solved),
            lambda row: Job(row.run, row.method, time_limit_s=row.time_limit_s),
            lambda row: (row.scenario, 0),
        )

    @property
    def environments(self) -> list[dict[str, str]]:
        """With what the rows were made."""
        return read_manifest(self.data / "manifest.json")

    def missing(self, jobs: Sequence[Job]) -> list[Job]:
        """Return those jobs of whose rows the folder does not have all."""
        learned = {(row.run, row.method, row.iterations) for row in self.learned}
        solved = {(row.run, row.method, row.time_limit_s) for row in self.solved}
        return [
            job
            for job in jobs
            if (job.run, job.method, job.iterations if job.learns else job.time_limit_s)
            not in (learned if job.learns else solved)
        ]

    def make(self, jobs: Sequence[Job], engine: Engine, should_stop: Callable[[], bool] = never_stop) -> bool:
        """Make the runs that are missing, each written by its process once it has ended.

        Returns
        -------
        bool
            False if `should_stop` returned True before all were made; those that had ended are kept.

        Raises
        ------
        InputError
            If the folder cannot be made.
        """
        try:
            self.data.mkdir(parents=True, exist_ok=True)
            begin(self.data / "learning.csv", Learned)
            begin(self.data / "others.csv", Solved)
        except OSError as error:
            raise InputError(f"cannot be made: {str(error.strerror).lower()}", source=str(self.data)) from error
        wanted = self.missing(jobs)
        if wanted:
            note_environment(self.data / "manifest.json")
        return engine.map(partial(make_run, self.data), wanted, should_stop) is not None

    def publish(self) -> None:
        """Draw the figures and write the page, from the rows alone.

        Raises
        ------
        InputError
            If there are no rows of learning.
        """
        from alloc.allocators.experiments.reproduction.figures import draw_all

        text = self.text()
        draw_all(self.learned, self.solved, self.data)
        write_bytes_atomically(self.page, text.encode())

    def text(self) -> str:
        """Return the page.

        Raises
        ------
        InputError
            If there are no rows of learning.
        """
        from alloc.allocators.experiments.reproduction.page import page

        learned = self.learned
        if not learned:
            raise InputError("holds no runs of methods that learn; make some first", source=str(self.data))
        return page(learned, self.solved, self.environments)


def whole_runs(
    rows: Sequence[Row], job_of: Callable[[Row], Job], place_of: Callable[[Row], tuple[int, int]]
) -> list[Row]:
    """Return the rows of those runs that have all of theirs, each once: a run torn by a crash is made again."""
    runs: dict[Job, dict[tuple[int, int], Row]] = {}
    for row in rows:
        runs.setdefault(job_of(row), {})[place_of(row)] = row
    return [row for job, own in runs.items() if expected(job) <= own.keys() for row in own.values()]


def make_run(data: Path, job: Job) -> None:
    """Make a run and append its rows to the file of its kind."""
    if job.learns:
        from alloc.allocators.experiments.reproduction.learning import learn

        append(data / "learning.csv", learn(job))
    else:
        from alloc.allocators.experiments.reproduction.others import solve_all

        append(data / "others.csv", solve_all(job))
