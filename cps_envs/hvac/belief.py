"""The defence as a learner plays it: each sensor is believed or not, and the believed ones feed the controller."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.adapter import Adapter
from cps_envs.core.fields import Field, Fields
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.hvac.columns import encoded, squeeze, squeezed
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import MEAN_H
from cps_envs.hvac.neighbours import Neighbours, most_of_others, of_others
from cps_envs.hvac.observation import MOST_STD, NEAR_C
from cps_envs.hvac.sensors import membership, zones_of_sensors

BELIEVE = 1  # the action; 0 leaves the sensor out


def belief_fields(config: HvacConfig) -> Fields:
    """What the defender's agent of one sensor sees; bounds are such that a neutral episode fills a good part of them.

    Innovations i are readings minus predictions of a Kalman filter, m their means over 2 h. The filters are those of
    all sensors, of none (the model), of the largest set without the sensor ("without"), and of the set that was chosen
    last. Estimates x are of the sensor's zone, by filters or by the observers (4.31) of sets.
    """
    log = "ln(1 + J/eps)"
    return Fields(
        Field("i_all", "std", -4, 4, (), "innovation of the filter of all"),
        squeezed("i_model", "std", MOST_STD, "innovation of the filter of none"),
        squeezed("i_without", "std", MOST_STD, "innovation of the filter without"),
        Field("i_chosen", "std", -4, 4, (), "innovation of the filter of what was chosen last"),
        Field("m_all", "std", -1, 1, (), f"mean over {MEAN_H:g} h of i_all"),
        squeezed("m_model", "std", MOST_STD, "mean of i_model"),
        squeezed("m_without", "std", MOST_STD, "mean of i_without"),
        Field("m_chosen", "std", -1, 1, (), "mean of i_chosen"),
        Field("others_m_all", "std", -0.5, 0.5, (), "mean of m_all of the other sensors"),
        squeezed("others_m_model", "std", MOST_STD, "mean of m_model of the other sensors"),
        Field("most_m_all", "std", 0, 1, (), "largest size of m_all of the other sensors"),
        Field("most_m_model", "std", 0, 8, (), "largest size of m_model of the other sensors"),
        Field("most_m_without", "std", 0, 8, (), "largest size of m_without of the other sensors"),
        Field("size_m_all", "std", 0, 1, (), "size of m_all"),
        Field("size_m_model", "std", 0, 8, (), "size of m_model"),
        Field("size_m_without", "std", 0, 8, (), "size of m_without"),
        squeezed("x_all", "C", NEAR_C, "estimate by the filter of all, minus the reference"),
        squeezed("x_observer", "C", NEAR_C, "estimate by the observer without, minus the reference"),
        squeezed("observer_filter", "C", NEAR_C, "observer without minus filter of all"),
        squeezed("alone_observer", "C", NEAR_C, "observer of the smallest set with the sensor minus that without"),
        squeezed("without_all", "C", NEAR_C, "filter without minus filter of all"),
        squeezed("without_model", "C", NEAR_C, "filter without minus filter of none"),
        Field("j_without", log, 0, 6, (), "residual of the observer without"),
        Field("jm_without", log, 0, 4, (), "its mean since the window is full"),
        Field("j_alone", log, 0, 4, (), "residual of the smallest set with the sensor"),
        Field("jm_alone", log, 0, 4, (), "its mean"),
        Field("jm_least", log, 0, 1, (), "smallest mean residual of any set"),
        Field("believed", "-", 0, 1, (), "what was chosen last uses the sensor"),
        Field("others_believed", "-", 0, 1, (), "share of the other sensors that it uses"),
        Field("left_h", "h", 0, config.duration_h, (), "until the end of the episode"),
        Field("time_of_day", "-", -1, 1, (2,), "sine and cosine of the 24 h angle"),
        Field("outdoor_c", "C", *_outside(config), (), "outside temperature now, as forecast"),
    )


def _outside(config: HvacConfig) -> tuple[float, float]:
    swing = max(abs(config.outdoor_swing_c), 1.0)
    return config.outdoor_mean_c - swing, config.outdoor_mean_c + swing


class Belief(Adapter):
    """A team of one agent for each sensor, which says whether it is believed.

    The believed sensors feed the controller. All of them: by their Kalman filter. Some: by the observer (4.31) of the
    largest set of believed sensors that the configuration offers, the first of equals. Where it offers none, the model
    does. Before the window is full the choice is the model, which then means the recursive least squares of all. The
    neutral action believes.

    Raises:
        ConfigurationError: a configuration without Kalman filters, or with a sensor that is in no set or in all.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config: HvacConfig = spec.config
        self._config, self._near = config, Neighbours(config)
        self.agents = tuple(f"sensor_{s + 1}" for s in range(config.num_sensors))
        self.fields = belief_fields(config)
        self.action_space = spaces.Discrete(2)
        self.neutral_action = np.array(BELIEVE)
        self._zone, self._member = zones_of_sensors(config), membership(config)  # (S,), (sets, S)
        self._size: IntArray = self._member.sum(axis=1)
        self._model = len(self._member) + 1  # the choice; the filters' come after it
        self._used = self._sensors_of_choices()

    def _sensors_of_choices(self) -> BoolArray:
        """Which sensors each choice of the defender uses, (C, S): all for the raw readings, none for the model."""
        ends = np.ones((1, len(self.agents)), np.bool_)
        return np.concatenate([ends, self._member, ~ends, self._near.member])

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Whether the window is full, (B, S): before that no choice but the model has an effect."""
        return np.repeat(seen["ready"][:, np.newaxis] > 0.5, len(self.agents), axis=1)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """Choices (B,) from who is believed (B, S)."""
        believed = actions == BELIEVE
        fits = ~(self._member & ~believed[:, np.newaxis]).any(axis=2)  # (B, sets)
        sizes = np.where(fits, self._size, 0)
        chosen = np.where(sizes.any(axis=1), 1 + sizes.argmax(axis=1), self._model)
        chosen = np.where(believed.all(axis=1), self._model + 1 + self._near.everybody, chosen)
        return np.where(seen["ready"] > 0.5, chosen, self._model), state

    def observe(self, seen: Seen, state: State) -> Observation:
        """See `belief_fields`, (B, S, size)."""
        columns = {**self._innovations(seen), **self._estimates(seen), **self._residuals(seen), **self._setting(seen)}
        return encoded(self.fields, columns)

    def _innovations(self, seen: Seen) -> dict[str, FloatArray]:
        near, i, m = self._near, seen["innovation"], seen["innovation_mean"]
        rows, chosen = np.arange(len(seen)), self._chosen_filter(seen)
        m_all, m_model, m_without = m[:, near.everybody], m[:, near.nobody], m[:, near.without, near.own]
        same = np.ones_like(m_all)
        return {
            "i_all": i[:, near.everybody],
            "i_model": squeeze(i[:, near.nobody], "std"),
            "i_without": squeeze(i[:, near.without, near.own], "std"),
            "i_chosen": i[rows, chosen],
            "m_all": m_all,
            "m_model": squeeze(m_model, "std"),
            "m_without": squeeze(m_without, "std"),
            "m_chosen": m[rows, chosen],
            "others_m_all": of_others(m_all, same),
            "others_m_model": squeeze(of_others(m_model, same), "std"),
            "most_m_all": most_of_others(np.abs(m_all)),
            "most_m_model": most_of_others(np.abs(m_model)),
            "most_m_without": most_of_others(np.abs(m_without)),
            "size_m_all": np.abs(m_all),
            "size_m_model": np.abs(m_model),
            "size_m_without": np.abs(m_without),
        }

    def _chosen_filter(self, seen: Seen) -> IntArray:
        """The filter (B,) with the sensors of the last choice; that of all for the raw readings and at the start."""
        last = seen["last_choice"].argmax(axis=1)
        by_set = np.where(last == 0, self._near.everybody, np.where(last == self._model, self._near.nobody, last - 1))
        chosen: IntArray = np.where(last > self._model, last - self._model - 1, by_set)
        return chosen

    def _estimates(self, seen: Seen) -> dict[str, FloatArray]:
        near, x = self._near, seen["estimate"] - self._config.reference_c
        filters = x[:, self._model + 1 :]
        everybody, without = filters[:, near.everybody, self._zone], filters[:, near.without, self._zone]
        observer = x[:, 1 + near.without, self._zone]
        return {
            "x_all": squeeze(everybody, "C"),
            "x_observer": squeeze(observer, "C"),
            "observer_filter": squeeze(observer - everybody, "C"),
            "alone_observer": squeeze(x[:, 1 + near.alone, self._zone] - observer, "C"),
            "without_all": squeeze(without - everybody, "C"),
            "without_model": squeeze(without - filters[:, near.nobody, self._zone], "C"),
        }

    def _residuals(self, seen: Seen) -> dict[str, FloatArray]:
        j, mean, near = seen["residual"], seen["mean_residual"], self._near
        return {
            "j_without": j[:, near.without],
            "jm_without": mean[:, near.without],
            "j_alone": j[:, near.alone],
            "jm_alone": mean[:, near.alone],
            "jm_least": mean.min(axis=1, keepdims=True),
        }

    def _setting(self, seen: Seen) -> dict[str, FloatArray]:
        """Who was believed, and the clock."""
        used = self._used[seen["last_choice"].argmax(axis=1)]
        believed = used.astype(np.float64)
        return {
            "believed": believed,
            "others_believed": of_others(believed, np.ones_like(believed)),
            "time_of_day": seen["time_of_day"][:, np.newaxis],
            "left_h": self._config.duration_h - seen["elapsed_h"][:, np.newaxis],
            "outdoor_c": seen["outdoor_c"][:, :1],
        }
