# A researcher: fifty text tables of a colleague, two methods on each, and a table for a paper.
python write_tables.py
python read_tables.py
alloc validate instances/07.npz
alloc compare instances --methods greedy,local-search --iterations 5 --store runs.db --report table.tex --report runs.csv --csv rows.csv
alloc compare instances --methods greedy,local-search --iterations 5 --store runs.db --json
