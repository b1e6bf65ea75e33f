"""The defence as a learner plays it: each sensor is believed or not, and the believed ones feed the controller."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, IntArray, Observation, State
from cps_envs.hvac.building import outdoor_range
from cps_envs.hvac.columns import squeezed
from cps_envs.hvac.comparison import fill_rows, tables
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import MEAN_H
from cps_envs.hvac.neighbours import Neighbours
from cps_envs.hvac.observation import MOST_STD, NEAR_C
from cps_envs.hvac.sensors import membership, sensor_names

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
        Field("outdoor_c", "C", *outdoor_range(config), (), "outside temperature now, as forecast"),
    )


class Belief(Adapter):
    """A team of one agent for each sensor, which says whether it is believed.

    The believed sensors feed the controller. All of them: by their Kalman filter. Some: by the observer (4.31) of the
    largest set of believed sensors that the configuration offers, the first of equals. Where it offers none, the model
    does. Before the window is full the choice is the model, which then means the recursive least squares of all. The
    neutral action believes.

    Raises:
        ConfigurationError: a configuration without Kalman filters, with a sensor that is in no set or in all, or with
            thermostats.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config: HvacConfig = spec.config
        if config.thermostats:
            raise ConfigurationError(
                'the adapter "sensor" cannot hand the heating to thermostats: take interface="native", or leave '
                "thermostats out."
            )
        self._everybody = Neighbours(config).everybody
        self.agents = sensor_names(config)
        self.fields = self._rows = belief_fields(config)
        self.action_space = spaces.Discrete(2)
        self.neutral_action = np.array(BELIEVE)
        self._member = membership(config)  # (sets, S)
        self._size: IntArray = self._member.sum(axis=1)
        self._model = len(self._member) + 1  # the choice; the filters' come after it
        self._tables = tables(config)

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Whether the window is full, (B, S): before that no choice but the model has an effect."""
        return np.repeat(seen["ready"][:, np.newaxis] > 0.5, len(self.agents), axis=1)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """Choices (B,) from who is believed (B, S)."""
        believed = actions == BELIEVE
        fits = ~(self._member & ~believed[:, np.newaxis]).any(axis=2)  # (B, sets)
        sizes = np.where(fits, self._size, 0)
        chosen = np.where(sizes.any(axis=1), 1 + sizes.argmax(axis=1), self._model)
        chosen = np.where(believed.all(axis=1), self._model + 1 + self._everybody, chosen)
        return np.where(seen["ready"] > 0.5, chosen, self._model), state

    def observe(self, seen: Seen, state: State) -> Observation:
        """See `belief_fields`, (B, S, size)."""
        rows = np.empty((len(seen), len(self.agents), self._rows.size), np.float32)
        theirs, own = self.spec.fields, self._rows
        fill_rows(self._tables, seen.observation, theirs.scale, theirs.offsets, rows, own.scale, own.offsets)
        return rows
