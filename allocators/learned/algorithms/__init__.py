"""The learning algorithms: PPO, A2C, DQN, DDPG, and GAPPO."""
