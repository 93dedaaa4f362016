# A researcher: what one more drone brings.
alloc generate paper-1 --seed 7 --output fleet.json
alloc whatif fleet.json --add "like a1" --up-to 3 --time-limit 0.5 --plot more.png
alloc whatif fleet.json --add "like a1" --up-to 3 --time-limit 0.5 --json
