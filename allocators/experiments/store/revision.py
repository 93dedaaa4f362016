"""The commit of this package, as far as it is known."""

import json
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

PATIENCE_S = 5.0
"""Seconds that git may take."""


@cache
def revision() -> str:
    """Return the commit of alloc, with ``+`` behind it where files have been changed since; empty where not known.

    It is that of the checkout from which alloc is imported or, after ``pip install git+...``, that which pip has noted.
    """
    own = Path(__file__).resolve()
    tracked = _git(own, "ls-files", own.name)  # an environment may lie within the checkout of something else
    if tracked:
        changed = _git(own, "status", "--porcelain", "--untracked-files=no")
        return (_git(own, "rev-parse", "HEAD") or "") + ("+" if changed else "")
    try:
        noted = json.loads(distribution("alloc-mrta").read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, ValueError):
        return ""
    return str(noted.get("vcs_info", {}).get("commit_id", ""))


def _git(own: Path, *arguments: str) -> str:
    command = ["git", "-C", str(own.parent), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
