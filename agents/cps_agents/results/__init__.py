"""What the shipped policies have to reach, and whether they do."""
