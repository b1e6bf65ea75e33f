"""What the pictures of all problems are drawn with."""
