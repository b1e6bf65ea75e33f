"""Which algorithm wins where: algorithms x tracks at equal CPU time, see `python -m tools.algorithms --help`."""
