"""``python -m alloc`` is ``alloc``; the package stays a namespace, which may have a module of this name."""

import sys

from alloc.cli.start import start

sys.exit(start())
