"""Make an instance of each table."""

from pathlib import Path

from alloc.problems import Instance, write_instance

Path("instances").mkdir()
for path in sorted(Path("tables").glob("*.txt")):
    ability, workload = ([float(word) for word in line.split()] for line in path.read_text().splitlines())
    write_instance(Instance(name=path.stem, ability=ability, workload=workload), f"instances/{path.stem}.npz")
