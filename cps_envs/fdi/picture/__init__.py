"""Drawings of a platoon under false data injection."""
