"""Packages that the environments need."""

import subprocess
import sys


def test_missing_packages_are_named() -> None:
    """Without the extra, the message says what to install."""
    code = (
        "import sys\nsys.modules['gymnasium'] = None\n"
        "try:\n    import alloc.problems.environments\nexcept ModuleNotFoundError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install 'alloc-mrta[env]'" in done.stdout
