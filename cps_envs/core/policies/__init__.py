"""Policies: the protocol, how one is found by name, and the adapters and teams through which a role is played."""
