"""Tries to break the package: hostile inputs, killed commands, long runs; counts what came out."""
