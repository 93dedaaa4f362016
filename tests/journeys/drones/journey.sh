# A drone operator: a fleet by latitude and longitude, around a no-fly zone, from two spreadsheets to a map.
alloc import --agents agents.csv --tasks tasks.csv --distances detours.csv --missing metric --output fleet.json
alloc validate fleet.json
alloc solve fleet.json --objective makespan-energy --time-limit 60 --output plan.json --plot plan.png
alloc solve fleet.json --objective makespan-energy --time-limit 0.5 --output plan.csv
alloc solve fleet.json --objective makespan-energy --time-limit 0.5 --output plan.geojson
alloc solve fleet.json --objective makespan-energy --time-limit 0.5 --output plan.html
alloc evaluate fleet.json plan.json
