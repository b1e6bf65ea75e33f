"""The game: a batch of episodes, the policies that play some of its roles, and the problem that declares both."""
