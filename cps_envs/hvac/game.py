"""The HVAC game: B heated buildings, an attacker who forges sensors, a defender who chooses which to believe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.generators import drawing
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, kernel, lend, pack, unpack, view
from cps_envs.core.declare.columns import ActionColumn, counted, numbered
from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.measures import Measure, measures_of
from cps_envs.core.declare.places import halves_of
from cps_envs.core.game.game import Adapters, Game
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.hvac.attack import deliver, sense, shift_references
from cps_envs.hvac.belief import Belief
from cps_envs.hvac.config import HvacConfig, has_preset_sizes
from cps_envs.hvac.disturbance import Drift, disturbances
from cps_envs.hvac.dynamics import heat, move
from cps_envs.hvac.estimation import choose, estimate
from cps_envs.hvac.expected import Expected, Together
from cps_envs.hvac.model import Model, Rules, build_model, rules_of
from cps_envs.hvac.observation import attacker_fields, defender_fields, observe_attacker, observe_defender
from cps_envs.hvac.payoff import count_choice, count_errors, measure, paid_at_start
from cps_envs.hvac.picture.scene import Scene, scene_of
from cps_envs.hvac.planning import make_desk
from cps_envs.hvac.powers import powers_of
from cps_envs.hvac.sensors import sensors_of_choices
from cps_envs.hvac.start import Chances, Draws, draw, draws_of, start
from cps_envs.hvac.state import Metrics, State, allocate, make_scratch
from cps_envs.hvac.teams import Believers, Liars, SensorTeam
from cps_envs.hvac.two_tests import TwoTests

READINGS = 0  # the choice of the raw readings


class Views(NamedTuple):
    """Arrays that hold the roles' observations in units, and where each field begins."""

    attacker: FloatArray  # (B, size)
    defender: FloatArray  # (B, size)
    attacker_at: Array  # (1,) Fields.offsets
    defender_at: Array  # (1,)


class Batch(NamedTuple):
    """All that kernels know of B environments."""

    model: Model
    rules: Array  # (1,) records of `model.Rules`
    state: State
    views: Views


class HvacGame(Game):
    """A game step is one sample, 120 s; both roles decide at every step k = 0..718, at the same time.

    Attacker: Box (entries,), see `powers`: S + 1, or S with `attack_action="bias"`, and what else the configuration
    lets it do. It forges the readings of k + 1, see `attack.sense`, and changes commands and set-points of k.
    Defender: Discrete(sets + 2 + F), and one more with `thermostats`. Its choice answers the readings of k: 0 feeds
    them to the controller as they are, 1..sets the estimate from that set, and sets + 1 the model's prediction. The F
    actions after that feed estimates of Kalman filters, if the configuration offers any (`sensors.filter_sets`). The
    last action hands the heating to thermostats. Before the window of N_e samples is full only 0, sets + 1 and the
    thermostats are legal, and all others mean the recursive least squares of all sensors.

    Payoff: |x(k + 1) - x_r|^2 / T_a from the onset on, so that the return is A_impact (4.19), or what `payoff` says.
    """

    name = "hvac"
    measures: ClassVar[Mapping[str, Measure]] = measures_of(Metrics)
    adapters: ClassVar[Adapters] = {
        "attacker": {"expected": Expected, "together": Together, "two_tests": TwoTests},
        "defender": {"sensor": Belief},
    }
    threaded = True

    def __init__(self, config: HvacConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config: HvacConfig = config
        self.horizon = config.num_steps - 1
        self.step_s = config.step_s
        self.decision_interval = {"attacker": 1, "defender": 1}
        self.fields = {"attacker": attacker_fields(config), "defender": defender_fields(config)}
        self.constants, self.rules = build_model(config), rules_of(config)
        entries, choices = powers_of(config).entries, len(sensors_of_choices(config))
        self.action_space = {
            "attacker": spaces.Box(-1.0, 1.0, (entries,), np.float32),
            "defender": spaces.Discrete(choices),
        }
        self.neutral_action = {"attacker": np.zeros(entries), "defender": np.array(READINGS)}
        self.payoff_parts = ("a_impact",)
        heat, *forecast = (bounds(size)[1] > 0 for size in disturbances(config))
        self.state: State = allocate(num_envs, self.constants, self.rules, drifting=heat, misforecast=any(forecast))
        self._views = Views(
            attacker=np.zeros((num_envs, self.fields["attacker"].size)),
            defender=np.zeros((num_envs, self.fields["defender"].size)),
            attacker_at=self.fields["attacker"].offsets,
            defender_at=self.fields["defender"].offsets,
        )
        batch = Batch(self.constants, pack(self.rules), self.state, self._views)
        self._batch = hold(batch, told=has_preset_sizes(config))
        self._draw_from(config)
        self._episodes: IntArray = np.arange(num_envs)
        self._quiet = np.zeros((num_envs, entries))
        self._raw = np.full(num_envs, READINGS)
        self._legal = np.ones((2, choices), np.int8)  # choices before the window is full, and from then on
        self._legal[0, 1:] = 0
        self._legal[0, -1] = config.thermostats
        self._legal[0, len(self.constants.member) + 1] = 1
        self.pay_as_configured()

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        self._episodes[envs] += self.num_envs
        with drawing(generators, np.flatnonzero(envs)) as streams:
            begin(self._batch, self._draws, halves_of(generators, envs), streams, self._quiet, envs)

    def _draw_from(self, drawn: HvacConfig) -> None:
        self._draws = draws_of(drawn)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        payoff = np.zeros(self.num_envs)
        forging, choices = actions.get("attacker", self._quiet), actions.get("defender", self._raw)
        self.threads.run(lambda mine: step(self._batch, forging, choices, mine, num_steps, payoff), envs, num_steps)
        return payoff

    def observe(self, role: Role) -> Observation:
        """See `observation.attacker_fields` and `observation.defender_fields`."""
        if role == "attacker":
            show_attacker(self._batch)
            return self.fields[role].encode(self._views.attacker)
        show_defender(self._batch)
        return self.fields[role].encode(self._views.defender)

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal choices (B, C) of the defender; the attacker's actions are always legal."""
        if role == "attacker":
            return None
        ready = self.state.step >= self.config.window_steps
        return self._legal[ready.astype(np.int64)].astype(np.bool_)

    def episode_mask(self, role: Role, b: int) -> Array | None:
        """Legal choices (C,) of one episode as int8."""
        if role == "attacker":
            return None
        legal: Array = self._legal[int(self.state.step.item(b) >= self.config.window_steps)].copy()
        return legal

    def metrics(self) -> dict[str, Array]:
        """`state.Metrics` so far, each (B,)."""
        return {name: self.state.metrics[name] for name in Metrics._fields}

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        return dict(zip(Metrics._fields, self.state.metrics.item(b)))  # noqa: B905, strict costs a microsecond

    def parts(self) -> tuple[Array, ...]:
        """See the base class; noise and disturbances to come are among them."""
        return tuple(self.state)

    def truth(self, b: int) -> Mapping[str, Array]:
        """Privileged: which sensors are compromised (S,), and the true temperatures (n,), C."""
        return {"compromised": self.state.compromised[b], "temperature": self.state.temperature[b]}

    def mean_residuals(self) -> FloatArray:
        """Jm_a(k) of (4.33), (B, sets) C2; 0 until the window is full."""
        return self.state.mean_residual.copy()

    def columns(self, role: Role) -> tuple[ActionColumn, ...]:
        """Forged readings in C and what they are added to, or the choice."""
        if role == "defender":
            meaning = "0 raw readings, then the sets, the model, Kalman filters, and thermostats"
            return numbered(["choice"], "-", meaning)
        config, count = self.config, self.config.num_sensors
        reach = (0.5 * (self.constants.sensor_high_c - self.constants.sensor_low_c)).tolist()
        names = counted("bias_c", count)
        added = tuple(
            ActionColumn(name, "C", "added to what `base` says, if held", each)
            for name, each in zip(names, reach, strict=True)
        )
        based = "-1 adds to the true temperature, 0 to the own reading, 1 to the middle of the sensor range"
        return added + numbered(["base"] if config.attack_action == "any" else [], "-", based) + self._beyond()

    def _beyond(self) -> tuple[ActionColumn, ...]:
        """The attacker's columns of commands, set-points and denial."""
        powers, n, columns = powers_of(self.config), self.config.num_zones, tuple[ActionColumn, ...]()
        for at, stem, unit, reach, meaning in (
            (powers.commands_at, "command_w", "W", self.constants.command_attack_w, "added to the heating command"),
            (powers.references_at, "shift_c", "C", self.constants.reference_attack_c, "by which the set-point moves"),
        ):
            if at >= 0:
                each = zip(counted(stem, n), reach.tolist(), strict=True)
                columns += tuple(ActionColumn(name, unit, meaning, most or 1.0) for name, most in each)
        denied = (("deny_readings", powers.deny_readings_at), ("deny_commands", powers.deny_commands_at))
        held = "above 1/3 none arrive, and the last ones stay"
        return columns + numbered([name for name, at in denied if at >= 0], "-", held)

    def team(self, role: Role) -> SensorTeam:
        """One agent for each sensor, see `teams`."""
        return (Liars if role == "attacker" else Believers)(self.config, self.constants, self.state)

    def privileged(self, role: Role) -> Observation:
        """The mean of what the agents of the team are told, (B, p)."""
        told: Observation = self.team(role).privileged().mean(axis=1)
        return told

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        return scene_of(self.config, self.state, self.constants, b, int(self._episodes[b]), self.episode_metrics(b))


@kernel
def begin(batch: Batch, draws: Draws, halves: IntArray, streams: Array, quiet: FloatArray, envs: BoolArray) -> None:
    """Draw episodes from the streams (B, 6) and put them at k = 0, in the marked environments (B,).

    `halves` (B,) says in which part of the series they begin. The first readings of the sensors nobody has forged.
    """
    model, rules = lend(batch.model), unpack(Rules, batch.rules, 0)
    chance, drift, room = unpack(Chances, draws.chances, 0), unpack(Drift, draws.drift, 0), make_scratch(model)
    for b in range(len(envs)):
        if envs[b]:
            episode, scratch = view(batch.state, b), lend(room)
            draw(borrowed(streams)[b], chance, drift, draws, halves[b], episode, scratch)
            start(model, rules, episode)
            count_errors(model, rules, episode)
            sense(model, rules, episode, borrowed(quiet)[b])
            estimate(model, rules, episode, scratch)
            measure(rules, episode)


@kernel
def step(
    batch: Batch,
    forging: FloatArray,
    choices: IntArray,
    envs: BoolArray,
    num_steps: int,
    payoff: FloatArray,
) -> None:
    """Take `num_steps` steps in the marked environments (B,) and add to the attacker's `payoff` (B,).

    The defender's `choices` (B,) answer the readings of k; the attacker's actions `forging` (B, S + 1) or (B, S) make
    those of k + 1. In the first step the attacker is paid for x(0) too, if the attack counts from there.
    """
    model, rules = lend(batch.model), unpack(Rules, batch.rules, 0)
    room, table = make_scratch(model), make_desk(batch.state.plan.shape[1], batch.state.plan.shape[2])
    for b in range(len(envs)):
        if envs[b]:
            episode, scratch, desk, action = view(batch.state, b), lend(room), lend(table), borrowed(forging)[b]
            if episode.step[0] == 0:
                payoff[b] = paid_at_start(rules, episode)
            for _ in range(num_steps):
                choose(model, rules, episode, choices[b], scratch.change)
                count_choice(model, rules, episode)
                shift_references(model, rules, episode, action)
                heat(model, rules, episode, scratch.change, desk)
                deliver(model, rules, episode, action)
                move(model, rules, episode, scratch)
                payoff[b] += count_errors(model, rules, episode)
                sense(model, rules, episode, action)
                estimate(model, rules, episode, scratch)
            measure(rules, episode)


@kernel
def show_attacker(batch: Batch) -> None:
    """Bring what the attacker observes up to the state of all environments."""
    model, views, rules = lend(batch.model), lend(batch.views), unpack(Rules, batch.rules, 0)
    for b in range(len(batch.state.step)):
        observe_attacker(model, rules, view(batch.state, b), views.attacker_at[0], views.attacker[b])


@kernel
def show_defender(batch: Batch) -> None:
    """Bring what the defender observes up to the state of all environments."""
    model, views, rules = lend(batch.model), lend(batch.views), unpack(Rules, batch.rules, 0)
    for b in range(len(batch.state.step)):
        observe_defender(model, rules, view(batch.state, b), views.defender_at[0], views.defender[b])
