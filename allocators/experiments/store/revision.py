"""The commit of this package, if known."""

import json
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

PATIENCE_S = 5.0
"""Time limit for git, in seconds."""


@cache
def revision() -> str:
    """Return the commit of alloc, followed by ``+`` if files have been changed since; empty if unknown.

    For alloc imported from a checkout, its commit; after ``pip install git+...``, the commit that pip recorded.
    """
    own = Path(__file__).resolve()
    tracked = _git(own, "ls-files", own.name)  # an environment may be inside the checkout of another project
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
