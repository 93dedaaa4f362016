# A researcher in reinforcement learning: a policy trained on instances of one's own beside the one that ships.
alloc generate random --agents 8 --tasks 3 --count 4 --seed 1 --output mine
alloc train ppo --instances mine --steps 300 --generation-steps 150 --output mine.safetensors
alloc compare mine --methods 'ppo,ppo[policy=mine.safetensors]' --iterations 2 --store runs.db --csv rows.csv
