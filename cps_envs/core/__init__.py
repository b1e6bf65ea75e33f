"""What every problem shares: the game protocol, the policy protocol, and the faces that learners know."""
