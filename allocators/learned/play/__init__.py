"""Playing the game with a policy: sampling of actions, rollouts, trajectories and transitions."""
