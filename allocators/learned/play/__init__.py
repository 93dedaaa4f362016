"""Playing the game by a policy: sampling of actions, rollouts, trajectories and transitions."""
