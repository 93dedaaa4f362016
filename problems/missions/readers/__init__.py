"""Import of missions from third-party files: benchmarks, configurations of simulators, and real records."""
