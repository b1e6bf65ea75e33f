"""Tries to break the package: hostile inputs, killed commands, long runs, mutants; counts what came out."""
