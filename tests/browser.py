"""Evaluation of scripts on pages in a headless browser."""

import json
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")

needs_browser = pytest.mark.skipif(BROWSER is None, reason="no browser is installed")


def run_in_browser(page: Path, script: str, folder: Path, size: str = "1200,800", flags: Sequence[str] = ()) -> object:
    """Return what `script` leaves as JSON in the body of the page, with a profile in `folder`; no console errors."""
    assert BROWSER is not None
    page.write_text(page.read_text(encoding="utf-8").replace("</body>", f"{script}</body>"), encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}"]
    command += ["--enable-logging=stderr", f"--window-size={size}", *flags, "--dump-dom", page.as_uri()]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert "CONSOLE" not in ran.stderr, ran.stderr[-2000:]
    found = re.search(r"<body>(.*?)</body>", ran.stdout, re.DOTALL)
    assert found is not None, ran.stderr[-2000:]
    return json.loads(found[1].replace("&lt;", "<").replace("&gt;", ">"))
