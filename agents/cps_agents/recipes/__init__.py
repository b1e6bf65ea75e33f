"""How policies are trained: `learning` has our own PPO for every role, each problem its policy search."""
