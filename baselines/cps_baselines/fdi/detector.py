"""Base of the defenders, an extension beyond the paper: they decide step by step which readings to use."""

from __future__ import annotations

from abc import abstractmethod

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State, repeat
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, IntArray
from cps_envs.fdi.config import FdiConfig

ROUNDING = 1e-3  # m and m/s; observations are of single precision


class Detector(AnalyticPolicy):
    """Base: distrusted readings are replaced from the next step on; commands are never corrected.

    Raises:
        ConfigurationError: the configuration has a filter, so that sensors are noisy.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.config: FdiConfig = spec.config
        if self.config.estimator == "kalman":
            raise ConfigurationError(
                f"{type(self).__name__} is for exact sensors: it would doubt noise. With estimator = "
                f'"kalman" use chi2, cusum, redundant_cusum or bank'
            )

    @abstractmethod
    def blank(self, envs: int) -> Array:
        """What is remembered of an episode at its start: zeros (B, ...)."""

    @abstractmethod
    def judge(self, seen: Seen, memory: Array, actions: IntArray) -> None:
        """Renew what is remembered (B, ...), and set the trust of readings that are not to be used to 0.

        The memory of an episode that begins, see `seen.start`, counts as blank. Actions (B, 3n) trust every reading
        before: ranges of vehicles 1..n, then range-rates.
        """

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, 3n): trust in every reading, then no correction."""
        memory = self.blank(len(seen)) if state is None else state[0].copy()
        actions = repeat(self.spec.neutral_action, len(seen))
        self.judge(seen, memory, actions)
        return actions, (memory,)
