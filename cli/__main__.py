"""``python -m alloc.cli`` is ``alloc``."""

import sys

from alloc.cli.main import main

sys.exit(main())
