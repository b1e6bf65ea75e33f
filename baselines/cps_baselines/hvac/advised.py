"""What learners of the defence play through if they start from `bayes`: whom to suspect more or less than that does."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_baselines.hvac.families import bayes
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Observation, State
from cps_envs.hvac.belief import Belief
from cps_envs.hvac.columns import squeeze, squeezed

SUSPICION = 6.0  # of an action of 1: added to the logarithm of the odds that a sensor lies; chosen
CAUTION = 1.5  # the same, of how many times as bad an estimate is that is too cold, the mean over sensors; chosen
SURE = 7.0  # bound of the logarithms of odds
MAX_BIAS_C = 12.0


class Suspecting(Belief):
    """A team of one agent for each sensor, which says how much more its sensor is to be suspected than `bayes` does.

    Box (2,), times `SUSPICION` and `CAUTION`. The weight of each set of liars is multiplied by e^suspicion for each of
    its members, at the choice; what `bayes` remembers stays. The second entry changes how much worse than a warm
    estimate a cold one is, by e to the mean over the agents. Zero adds nothing: the choices are those of `bayes`.
    Beside the row of `sensor` the agent sees what `bayes` believes of it.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._bayes = bayes(spec)
        self._zones = spec.config.num_zones
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.neutral_action = np.zeros(2, np.float32)
        self._own = Fields(
            Field("lies", "log odds", -SURE, SURE, (), "of the own sensor"),
            Field("other_lies", "log odds", -SURE, SURE, (), "of the most suspected other sensor"),
            Field("somebody_lies", "log odds", -SURE, SURE, (), "of any sensor"),
            squeezed("bias", "C", MAX_BIAS_C, "expected error of the own sensor"),
            squeezed("other_bias", "C", MAX_BIAS_C, "the one of the largest size of another sensor"),
        )
        self.fields = Fields(*self._rows, *self._own)

    def begin(self, num_envs: int) -> State:
        """What `bayes` remembers."""
        return self._bayes.begin([np.random.default_rng()] * num_envs, [])

    def observe(self, seen: Seen, state: State) -> Observation:
        """See the class, (B, S, size)."""
        return np.concatenate([super().observe(seen, state), self._believed(state)], axis=2)

    def _believed(self, state: State) -> Observation:
        """What `bayes` believes, (B, S, 5)."""
        estimates, weights, _ = state
        lies, sensors = self._bayes.lies, len(self.agents)
        probability = np.exp(weights)
        probability /= probability.sum(axis=1, keepdims=True)
        own = probability @ lies  # (B, S)
        held = estimates[:, :, 2 * self._zones : 2 * self._zones + sensors] * lies
        bias_c = np.einsum("bh,bhs->bs", probability, held)
        others = ~np.eye(sensors, dtype=np.bool_)
        worst = np.where(others, np.abs(bias_c)[:, np.newaxis], -1.0).argmax(axis=2)
        columns = {
            "lies": log_odds(own),
            "other_lies": log_odds(np.where(others, own[:, np.newaxis], 0.0).max(axis=2)),
            "somebody_lies": np.broadcast_to(log_odds(1.0 - probability[:, :1]), own.shape),
            "bias": squeeze(bias_c, "C"),
            "other_bias": squeeze(np.take_along_axis(bias_c, worst, axis=1), "C"),
        }
        values = np.stack([columns[field.name] for field in self._own], axis=2)
        return self._own.encode(values.reshape(-1, self._own.size)).reshape(values.shape)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """Choices (B,) from suspicions and cautions (B, S, 2)."""
        renewed = self._bayes.weighed(seen, state)
        weights = renewed[1] + SUSPICION * actions[..., 0] @ self._bayes.lies.T
        weights -= weights.max(axis=1, keepdims=True)
        caution = np.exp(CAUTION * actions[..., 1].mean(axis=1))
        return self._bayes.chosen(seen, renewed, weights, caution), renewed


def log_odds(probability: FloatArray) -> FloatArray:
    """ln(p / (1 - p)), at most `SURE` either way."""
    least = 1.0 / (1.0 + np.exp(SURE))
    within = np.clip(probability, least, 1.0 - least)
    odds: FloatArray = np.log(within / (1.0 - within))
    return odds
