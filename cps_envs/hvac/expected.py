"""The attack as a learner plays it: how far from what the filter expects each forged sensor shows its zone."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, State
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.columns import encoded, squeeze, squeezed
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import build_model
from cps_envs.hvac.neighbours import Neighbours, of_others
from cps_envs.hvac.observation import MOST_STD, NEAR_C
from cps_envs.hvac.powers import powers_of
from cps_envs.hvac.sensors import sensor_names

# All chosen. Levels beyond 1.6 are found out within the hour; the steps are finer where lies hide.
LEVELS = (-1.6, -0.8, -0.4, -0.2, 0.0, 0.2, 0.4, 0.8, 1.6)  # standard deviations of an innovation
GAIN = 0.3  # share of what is missing to the level by which the bias grows at each step; a larger one shows its noise
MAX_BIAS_C = 12.0  # of a bias either way
MOST_MEAN = 0.35  # standard deviations, of the mean innovation of a filter that uses the sensor
FRESH_H = 1.0  # age by which `fresh` has fallen to 1/e


def expected_fields(config: HvacConfig) -> Fields:
    """What the attacker's agent of one sensor sees; bounds are such that a neutral episode fills a good part of them.

    "Others" are the other compromised sensors.
    """
    return Fields(
        squeezed("bias", "C", MAX_BIAS_C, "reading minus what the sensor measured; 0 before the onset"),
        squeezed("others_bias", "C", MAX_BIAS_C, "mean bias of the others"),
        Field("others_level", "std", LEVELS[0], LEVELS[-1], (), "mean level that the others try to hold"),
        Field("innovation", "std", -4, 4, (), "reading minus prediction of the filter of all sensors"),
        Field("mean", "std", -MOST_MEAN, MOST_MEAN, (), "of this innovation, over 2 h"),
        Field("mean_alone", "std", -MOST_MEAN, MOST_MEAN, (), "the same of the filter of the smallest set with it"),
        squeezed("mean_without", "std", MOST_STD, "the same of the filter of the largest set without it"),
        squeezed("mean_by_model", "std", MOST_STD, "the same of the filter without sensors"),
        squeezed("error", "C", NEAR_C, "true temperature of the zone minus the reference"),
        squeezed("others_warmer", "C", NEAR_C, "mean temperature of the house minus that of the zone"),
        Field("attack_h", "h", 0, config.duration_h, (), "age of the attack"),
        Field("fresh", "-", 0, 1, (), f"falls from 1 at the onset to 1/e after {FRESH_H:g} h"),
        Field("left_h", "h", 0, config.duration_h, (), "until the end of the episode"),
        Field("time_of_day", "-", -1, 1, (2,), "sine and cosine of the 24 h angle"),
        Field("liars", "-", 0, config.max_compromised or 1, (), "compromised sensors"),
        Field("sensor", "-", 0, 1, (config.num_sensors,), "which sensor this is, one-hot"),
    )


class Expected(Adapter):
    """A team of one agent for each sensor, which says how many standard deviations off its innovation is held.

    The innovation is that of the Kalman filter of all sensors. A forged reading is what the sensor measured plus a
    bias b. The attacker knows the sensor's noise, measured minus true temperature, and so the innovation without it, r.
    At each step b(k + 1) = b(k) + gain (level - r) sigma, within `MAX_BIAS_C` either way. The filter takes what is left
    for drifting heat, so the lie grows. Level 0 keeps the innovations honest. This is the inner loop of the controller
    `tracker`; sign, size and schedule are the learner's.

    Agents are active where their sensor is compromised, from the onset on.

    Raises:
        ConfigurationError: a configuration without Kalman filters, or an attacker that does not see innovations, or
            that can do more than forge readings.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config: HvacConfig = spec.config
        if not config.kalman_filters or config.attacker_view != "white":
            raise ConfigurationError(
                'the adapter "expected" needs kalman_filters=true and attacker_view="white": it holds innovations of a '
                "filter. Use preset learning or hard, or play through adapter=native."
            )
        if powers_of(config).beyond_readings:
            raise ConfigurationError(
                'the adapters "expected", "together" and "two_tests" forge readings only: take interface="native", or '
                "leave command_attack_w, reference_attack_c and denial out."
            )
        self._config, self._near = config, Neighbours(config)
        self.agents = sensor_names(config)
        self.fields = expected_fields(config)
        self.action_space = spaces.Discrete(len(LEVELS))
        self.neutral_action = np.array(LEVELS.index(0.0))
        model = build_model(config)
        self._zone, self._levels = model.zone, np.array(LEVELS)
        self._scale = model.filter_scale[self._near.everybody]  # (S,) 1/C
        self._step_h = config.step_s / 3600.0

    def begin(self, num_envs: int) -> State:
        """The biases (B, S), C, and the levels (B, S) that are held."""
        shape = (num_envs, len(self.agents))
        return np.zeros(shape), np.zeros(shape)

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Whether the next reading is forged, (B, S)."""
        return self.forges(seen)

    def forges(self, seen: Seen) -> BoolArray:
        """The sensors (B, S) whose next reading is forged."""
        marks: BoolArray = (seen["compromised"] > 0.5) & (seen["active"] > 0.5)[:, np.newaxis]
        return marks

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The role's action (B, entries) from the indices of levels (B, S)."""
        bias_c, _ = state
        level = self._levels[actions]
        forges = self.forges(seen)
        bias_c = np.where(forges & self._begun(seen), self._grown(seen, bias_c, level), 0.0)
        return bias_action(self._config, -bias_c, keep_noise=True), (bias_c, np.where(forges, level, 0.0))

    def _begun(self, seen: Seen) -> BoolArray:
        """Whether a reading was forged already, (B, 1)."""
        begun: BoolArray = (seen["attack_h"] > 0.5 * self._step_h)[:, np.newaxis]
        return begun

    def _grown(self, seen: Seen, bias_c: FloatArray, level: FloatArray, noisy: FloatArray | float = 1.0) -> FloatArray:
        """The biases (B, S) that bring innovations nearer to their levels; of readings with `noisy` of the noise."""
        missing = (level - self._without_noise(seen, noisy)) / self._scale
        grown: FloatArray = np.minimum(np.maximum(bias_c + GAIN * missing, -MAX_BIAS_C), MAX_BIAS_C)
        return grown

    def _without_noise(self, seen: Seen, noisy: FloatArray | float) -> FloatArray:
        """Innovations (B, S) of the filter of all without the sensors' own noise, of which readings have `noisy`.

        With it where the true temperature is beyond the bounds of what the attacker sees.
        """
        true_c = seen["temperature"][:, self._zone]
        low_c, high_c = self._config.reference_range_c
        in_sight = np.abs(true_c - 0.5 * (low_c + high_c)) < 0.5 * (high_c - low_c) + NEAR_C - 1e-3
        noise_c = np.where(in_sight, seen["measured"] - true_c, 0.0)
        r: FloatArray = seen["innovation"][:, self._near.everybody] - noise_c * noisy * self._scale
        return r

    def observe(self, seen: Seen, state: State) -> Observation:
        """See `expected_fields`, (B, S, size)."""
        return encoded(self.fields, self.columns(seen, state))

    def columns(self, seen: Seen, state: State) -> dict[str, FloatArray]:
        """The values of each field, (B or 1, S or 1, *shape)."""
        bias_c, level = state[:2]
        near, mean, config = self._near, seen["innovation_mean"], self._config
        liars, age_h = seen["compromised"], seen["attack_h"][:, np.newaxis]
        scheduled = isinstance(config.reference_c, Series)
        error_c = seen["temperature"] - (seen["reference_c"] if scheduled else np.asarray(config.reference_c))
        own_c = error_c[:, self._zone]
        return {
            "bias": squeeze(bias_c, "C"),
            "others_bias": squeeze(of_others(bias_c, liars), "C"),
            "others_level": of_others(level, liars),
            "innovation": seen["innovation"][:, near.everybody],
            "mean": mean[:, near.everybody],
            "mean_alone": mean[:, near.alone, near.own],
            "mean_without": squeeze(mean[:, near.without, near.own], "std"),
            "mean_by_model": squeeze(mean[:, near.nobody], "std"),
            "error": squeeze(own_c, "C"),
            "others_warmer": squeeze(error_c.mean(axis=1, keepdims=True) - own_c, "C"),
            "attack_h": age_h,
            "fresh": np.exp(-age_h / FRESH_H),
            "left_h": config.duration_h - seen["elapsed_h"][:, np.newaxis],
            "time_of_day": seen["time_of_day"][:, np.newaxis],
            "liars": liars.sum(axis=1, keepdims=True),
            "sensor": np.eye(len(self._zone))[np.newaxis],
        }


class Together(Expected):
    """One agent that chooses a level for all compromised sensors. It sees the mean of their rows.

        Sensors that choose by themselves pull in different directions while they explore, and the return grows with the
    square of a lie. Together they find out sooner which sign is better.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.sensors, self.agents = len(self.agents), (spec.role,)

    def begin(self, num_envs: int) -> State:
        """The biases (B, S), C, and the levels (B, S) that are held."""
        return np.zeros((num_envs, self.sensors)), np.zeros((num_envs, self.sensors))

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Whether any next reading is forged, (B, 1)."""
        some: BoolArray = self.forges(seen).max(axis=1, keepdims=True)
        return some

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The role's action from the index (B, 1) of a level."""
        return super().act(seen, state, np.repeat(actions, self.sensors, axis=1))

    def observe(self, seen: Seen, state: State) -> Observation:
        """The mean (B, 1, size) of the compromised sensors' rows, of all where there are none."""
        liars = seen["compromised"].astype(np.float32)
        counted = np.where(liars.any(axis=1, keepdims=True), liars, np.float32(1.0))
        weights = counted / counted.sum(axis=1, keepdims=True)
        mean: Observation = (super().observe(seen, state) * weights[..., np.newaxis]).sum(axis=1, keepdims=True)
        return mean
