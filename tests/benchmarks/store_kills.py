"""Two commands on one store, with two processes each, killed by signals at random moments: 400 runs, 200 kills.

    python tests/benchmarks/store_kills.py --kills 200 --seeds 100

Prints what became of the runs: each must be in the store once, solved, with no lease left, and none may have been begun
again after it was written, nor by two processes at once.
"""

import argparse
import signal
import sys
import tempfile
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "allocators" / "experiments")]

from campaign_kills import SIGNALS, kill_often  # noqa: E402


def main() -> int:
    """Kill commands as often as asked, and return 0 where no run was lost, made twice, or left behind."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seeds", type=int, default=100, help="seeds for each of four instances")
    parser.add_argument("--nap", type=float, default=0.3, help="seconds of a run")
    parser.add_argument("--gap", type=float, default=2.0, help="most seconds between two kills")
    parser.add_argument("--signals", nargs="+", default=[one.name for one in SIGNALS], help="drawn for each kill")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = kill_often(
            Path(folder),
            seeds=options.seeds,
            kills=options.kills,
            nap_s=options.nap,
            gap_s=(0.0, options.gap),
            signals=[signal.Signals[name] for name in options.signals],
        )
    print(found)
    return 1 if found.lost or found.overlapping or found.again or found.leases else 0


if __name__ == "__main__":
    sys.exit(main())
