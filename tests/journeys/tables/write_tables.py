"""The colleague: fifty text tables, abilities in the first line and workloads in the second."""

from pathlib import Path

import numpy as np

Path("tables").mkdir()
for number in range(50):
    rng = np.random.default_rng(number)
    lines = (rng.integers(1, 20, 16), rng.integers(5, 50, 5))
    Path(f"tables/{number:02}.txt").write_text("\n".join(" ".join(map(str, line)) for line in lines))
