"""Files of a training: a resumed run overwrites its own policy, and no other file."""

from pathlib import Path

import pytest

from alloc.allocators.learned.files.run_files import RunFiles
from alloc.allocators.learned.missions.policy_file import SHIPPED
from alloc.problems import InputError


def test_policies_of_missions_are_recognised(tmp_path: Path) -> None:
    """Policies of missions differ from other safetensors files, so that such a training can be resumed."""
    files = RunFiles.beside(tmp_path / "p.safetensors", None, None, None)
    files.policy.write_bytes(SHIPPED.read_bytes())
    files.checkpoint.touch()
    files.check(resume=True)
    files.policy.write_bytes(b"something else")
    with pytest.raises(InputError, match="not a policy file"):
        files.check(resume=True)
