"""What learners play the roles of a false-data-injection duel through."""
