"""Which seeds are for what, so that nothing is judged on what it was trained on.

Episodes that `play`, `benchmark`, `league` and every report show have the seeds 0, 1, ...; training and the validation
that chooses among checkpoints never see those.
"""

from __future__ import annotations

EVALUATION = range(0, 1_000_000)
VALIDATION = range(1_000_000, 2_000_000)
TRAINING_START = 2_000_000
SEEDS_PER_RUN = 100_000  # more than any number of environments, times resumptions


def training_seed(seed: int, resumption: int = 0) -> int:
    """The seed of the first environment of a training run; a resumed run goes on with seeds of its own."""
    return TRAINING_START + seed * SEEDS_PER_RUN + resumption * (SEEDS_PER_RUN // 20)
