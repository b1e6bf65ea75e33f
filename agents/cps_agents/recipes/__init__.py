"""How policies are trained: `learning` has our own PPO for every role, and `finding` knows them by name."""
