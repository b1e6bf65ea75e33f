"""What every problem shares: the game protocol, the policy protocol, and the interfaces that learners know."""
