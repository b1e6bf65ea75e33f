"""The tracks of the challenge, as their makers freeze them."""
