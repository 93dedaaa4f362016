"""``python -m alloc.cli`` is ``alloc``."""

import sys

from alloc.cli.start import start

sys.exit(start())
