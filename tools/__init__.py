"""What only maintainers run, each by `python -m tools.NAME` in a checkout. Never part of the wheel."""
