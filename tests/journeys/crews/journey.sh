# A dispatcher: crews with skills; then one drops out and an urgent job comes in, and few are sent elsewhere.
alloc import --agents crews.csv --tasks jobs.csv --output today.json
alloc solve today.json --method cpsat --output plan.json
python change.py
alloc solve later.json --method cpsat --start plan.json --objective makespan-moves --makespan-slack 0.2 --output next.json
