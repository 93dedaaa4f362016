"""The files of a training run, and checks that no other files are overwritten; does not import torch."""

import zipfile
from dataclasses import dataclass
from pathlib import Path

from alloc.allocators.learned.files.policy_header import read_header
from alloc.problems import InputError

LOG_BEGINNING = b"generation,decisions,"


@dataclass(frozen=True)
class RunFiles:
    """Files that a training run writes.

    Attributes
    ----------
    policy : Path
        The best networks so far.
    checkpoint : Path
        The complete run, for resuming it.
    log : Path
        One CSV line per generation.
    tensorboard : Path or None
        Folder for event files.
    """

    policy: Path
    checkpoint: Path
    log: Path
    tensorboard: Path | None = None

    @classmethod
    def beside(
        cls,
        policy: Path | str,
        checkpoint: Path | str | None = None,
        log: Path | str | None = None,
        tensorboard: Path | str | None = None,
    ) -> "RunFiles":
        """Return the files of a run; by default, checkpoint and log are beside the policy, with their own suffixes."""
        output = Path(policy)
        return cls(
            output,
            output.with_suffix(".checkpoint") if checkpoint is None else Path(checkpoint),
            output.with_suffix(".csv") if log is None else Path(log),
            None if tensorboard is None else Path(tensorboard),
        )

    def check(self, *, resume: bool) -> None:
        """Check that the run overwrites only its own files.

        Empty files and checkpoints without generations may be overwritten.

        Raises
        ------
        InputError
            If a file has other content or a run that is not resumed, there is nothing to resume, or the suffix of the
            policy file is that of another format.
        """
        if resume and not self.checkpoint.exists():
            raise InputError("no such checkpoint; start without resume", source=str(self.checkpoint))
        if not resume and _is_filled(self.checkpoint):
            self._check_checkpoint()
        if _is_filled(self.policy) and not _is_policy(self.policy):
            message = "exists and is not a policy file; name another output, or remove it"
            raise InputError(message, source=str(self.policy))
        if _is_filled(self.policy) and not resume:
            message = "holds a policy, and no checkpoint to resume is beside it; name another output, or remove it"
            raise InputError(message, source=str(self.policy))
        if _is_filled(self.log) and not _is_log(self.log):
            message = "is there already, and no log of a training; name another log, or remove it"
            raise InputError(message, source=str(self.log))
        if self.policy.suffix.lower() not in ("", ".safetensors"):
            message = f"has the suffix {self.policy.suffix!r}, but policies are safetensors; end it in .safetensors"
            raise InputError(message, source=str(self.policy))

    def _check_checkpoint(self) -> None:
        """Raise an `InputError` if the file to be overwritten is not a checkpoint, or has generations."""
        if not zipfile.is_zipfile(self.checkpoint):
            message = "is there already, and no checkpoint; name another checkpoint, or remove it"
            raise InputError(message, source=str(self.checkpoint))
        if self.policy.exists() or _generations(self.checkpoint):
            message = "holds a training run; resume it, or name another checkpoint"
            raise InputError(message, source=str(self.checkpoint))


def _is_filled(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0


def _is_log(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(LOG_BEGINNING)) == LOG_BEGINNING


def _is_policy(path: Path) -> bool:
    try:
        header = read_header(path)
    except InputError:
        return False
    return "networks" in header or header.get("format", "").startswith("alloc-mission-policy/")


def _generations(checkpoint: Path) -> int:
    from alloc.allocators.learned.files.checkpoint import generations_in

    return generations_in(checkpoint)
