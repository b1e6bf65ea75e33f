"""The picture of a platoon with a seized vehicle."""
