"""How a network is wired to a role: through which adapter, how often it decides, and how its inputs are made.

The same wiring makes the rows of a training environment and the inputs of a trained policy that plays anywhere else.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.declare.actions import choices_of, flat_masks, flattened, unflattened
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.state import put
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role, State

Scaling: TypeAlias = tuple[tuple[float, ...], tuple[float, ...]]  # mean and deviation
CLIP = 5.0  # bound of a scaled input
LEAST_DEVIATION = 0.02  # of an input; one that hardly varies is not blown up to noise
NO_CHANGES = np.zeros((1, 1, 0), np.float32)
OWN = 5  # arrays of a wired player's state before those of its adapter


@dataclass(frozen=True)
class Wiring:
    """Everything that a network needs beside its weights to play a role; plain data.

    A row of inputs has, one after the other: what the adapter shows, its running averages, that of its changes, all of
    these scaled to (value - mean) / deviation; then the agent's last action, one-hot if it is discrete, zeros at an
    episode's start; then 1 for each action that is legal, if the role has masks.
    """

    problem: str
    role: Role
    adapter: str
    frame_skip: int = 1  # decisions of the role for which an action is kept
    recent_s: tuple[float, ...] = ()  # s, time constants of the running averages
    rough_s: float = 0.0  # s, time constant of the running average of the changes; 0: none
    masked: bool = False  # whether the last inputs say what is legal
    joint: bool = False  # whether one row holds all agents of a team side by side, and one action what all of them do
    flat: bool = False  # whether one number stands for all entries of a discrete action
    plain: bool = False  # whether a row holds nothing but what the adapter shows, unscaled
    mean: tuple[float, ...] = ()  # of the scaled inputs of an agent; empty: they are not scaled
    deviation: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ConfigurationError: one that makes no sense.
        """
        if self.frame_skip < 1:
            raise ConfigurationError(f"frame_skip = {self.frame_skip} must be at least 1")
        times = (*self.recent_s, self.rough_s) if isinstance(self.recent_s, tuple) else ("",)
        numbers = all(isinstance(time_s, (int, float)) and np.isfinite(time_s) for time_s in times)
        if not numbers or min(self.recent_s, default=1) <= 0 or self.rough_s < 0:
            raise ConfigurationError(
                f"recent_s = {self.recent_s} and rough_s = {self.rough_s} must be times in seconds"
            )
        if len(self.mean) != len(self.deviation) or any(not spread > 0 for spread in self.deviation):
            raise ConfigurationError("mean and deviation must be equally many numbers, each deviation above 0")


class WiredBox(spaces.Box):
    """The rows of a training environment, which carry their wiring.

    Whoever saves the observation space with a model, as stable-baselines3 does, saves with it how to play the model.
    """

    def __init__(self, columns: Columns, wiring: Wiring, agents: int, *, local: bool = False) -> None:
        """`agents` share a row; `local` ones see by sensors of their own."""
        super().__init__(-CLIP, CLIP, (agents * columns.size,), np.float32)
        self.columns, self.wiring, self.agents, self.local = columns, wiring, agents, local

    def __eq__(self, other: object) -> bool:
        """Whether rows are made alike: a model that was trained on others must not go on with these."""
        alike = not isinstance(other, WiredBox) or (self.wiring, self.agents) == (other.wiring, other.agents)
        return alike and super().__eq__(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """What rows are made of, and a digest of their scale."""
        wiring, (count,) = self.wiring, self.shape
        scale = hashlib.sha256(repr((wiring.mean, wiring.deviation)).encode()).hexdigest()[:8]
        how = f"adapter={wiring.adapter!r}, frame_skip={wiring.frame_skip}, scale {scale}"
        return f"WiredBox({count} inputs of {wiring.problem}, {wiring.role}: {how})"


@dataclass(frozen=True)
class Columns:
    """Where the parts of an agent's inputs lie."""

    scaled: int  # how many inputs are scaled, from the first on
    last_action: int  # how many say what the agent did last, after them
    mask: int  # how many say what is legal, at the end

    @property
    def size(self) -> int:
        """Inputs in a row."""
        return self.scaled + self.last_action + self.mask


class Wired:
    """A wiring bound to a role. Its methods are pure; `state` is a tuple of arrays with a leading axis of B episodes.

    The state is: what the agents see (B, A, m), its running averages (B, A, n, m), that of its changes (B, A, m), the
    actions that are kept (B, A, ...), decisions so far (B,), and then what the adapter remembers.
    """

    def __init__(self, wiring: Wiring, adapter: Adapter) -> None:
        """Bind it.

        Raises:
            ConfigurationError: the scaling has another number of inputs than the adapter gives.
        """
        self.wiring, self.adapter = wiring, adapter
        interval_s = adapter.spec.decision_interval_s
        self.recent = np.array([-np.expm1(-interval_s / time_s) for time_s in wiring.recent_s])
        self._rough = -np.expm1(-interval_s / wiring.rough_s) if wiring.rough_s else 0.0
        self.averages = bool(wiring.recent_s or wiring.rough_s)  # whether it has to see every decision of the role
        parts = 1 + len(wiring.recent_s) + bool(wiring.rough_s)
        self.choices = choices_of(adapter.action_space)
        shape = adapter.action_space.shape or ()
        mask = sum(self.choices) if wiring.masked and self.choices and not wiring.plain else 0
        last = 0 if wiring.plain else sum(self.choices) or int(np.prod(shape))
        self.columns = Columns(parts * adapter.fields.size, last, mask)
        if wiring.mean and len(wiring.mean) != self.columns.scaled:
            raise ConfigurationError(
                f"the network was trained with {len(wiring.mean)} scaled inputs, and {wiring.adapter!r} gives "
                f"{self.columns.scaled} here: it was trained in another configuration"
            )
        self.together = len(adapter.agents) if wiring.joint else 1  # agents that share a row
        self.rows = len(adapter.agents) // self.together  # of an episode
        self.action_space = action_space_of(adapter.action_space, self.together, flat=wiring.flat)
        self._neutral = np.asarray(adapter.neutral_action)
        mean, deviation = (np.array(each, np.float32) for each in (wiring.mean, wiring.deviation))
        self.scaled = (
            mean,
            (1 / deviation).astype(np.float32),
            np.array(self.choices, np.int64),
        )  # what `fill_inputs` needs to know

    def space(self) -> WiredBox:
        """The rows."""
        return WiredBox(self.columns, self.wiring, self.together, local=self.adapter.local)

    @property
    def neutral_action(self) -> Array:
        """The action of a row that is as good as none, of the shape of `action_space`."""
        entries = np.tile(np.ravel(self._neutral), self.together)
        if self.wiring.flat:
            return np.asarray(np.ravel_multi_index(tuple(entries), self.choices * self.together))
        return entries.reshape(self.action_space.shape or ())

    def begin(self, num_envs: int) -> State:
        """The state at the start of episodes."""
        agents, size = len(self.adapter.agents), self.adapter.fields.size
        row = np.zeros((num_envs, agents, size), np.float32)
        averages = np.zeros((num_envs, agents, len(self.recent), size), np.float32)
        neutral = self.adapter.neutral_action
        kept = np.full((num_envs, agents, *neutral.shape), neutral)
        return row, averages, row.copy(), kept, np.zeros(num_envs, np.int64), *self.adapter.begin(num_envs)

    def restart(self, state: State, envs: BoolArray) -> State:
        """A state with the marked environments (B,) at the start of an episode."""
        rows = envs.nonzero()[0]
        fresh = put(tuple(array.copy() for array in state), rows, self.begin(len(rows)), len(envs))
        assert fresh is not None
        return fresh

    def due(self, seen: Seen, state: State) -> BoolArray:
        """The environments (B,) in which the agents decide now."""
        if self.adapter.waits:
            return self.adapter.due(seen, state[OWN:])
        marks: BoolArray = state[4] % self.wiring.frame_skip == 0
        return marks

    def see(self, seen: Seen, state: State) -> State:
        """The state after a look; at every decision of the role if `averages`, else when the agents decide."""
        before, averages, rough, kept, age, *own = state
        row = self.adapter.observe(seen, tuple(own))
        first = (age == 0)[:, np.newaxis, np.newaxis]
        if self.recent.size:
            averages = averages.copy()
            average(row, age == 0, self.recent, averages)
        if self._rough:
            change = np.where(first, 0.0, np.abs(row - before) - rough)
            rough = rough + (self._rough * change).astype(np.float32)
        return row, averages, rough, kept, age, *own

    def inputs(self, seen: Seen, state: State) -> Observation:
        """The rows (B, A, columns.size) that a network gets."""
        row, averages, rough, kept, age, *own = state
        if self.wiring.plain:
            return row.copy()
        envs, agents = row.shape[:2]
        filled = np.empty((envs, agents, self.columns.scaled + self.columns.last_action), np.float32)
        row, rough = np.ascontiguousarray(row), rough if self._rough else NO_CHANGES
        fill_inputs(row, averages, rough, kept.reshape(envs, agents, -1), age, *self.scaled, filled)
        if self.columns.mask:
            mask = self.adapter.masks(seen, tuple(own))
            legal = np.ones((envs, agents, self.columns.mask)) if mask is None else mask
            return np.concatenate([filled, legal], axis=2, dtype=np.float32)
        return filled

    def row_actions(self, actions: Array) -> Array:
        """The agents' actions (B, A, ...) from those of the rows (B x rows, ...), which are in `action_space`."""
        if self.wiring.flat:
            actions = unflattened(actions, self.choices * self.together)
        return actions.reshape(-1, len(self.adapter.agents), *(self.adapter.action_space.shape or ()))

    def row_masks(self, seen: Seen, state: State) -> BoolArray | None:
        """Legal actions of the rows (B x rows, k); None where all are legal."""
        masks = self.adapter.masks(seen, state[OWN:]) if self.wiring.masked else None
        return None if masks is None else self._shared_masks(masks)

    def legal(self, rows: Observation) -> BoolArray:
        """The same from the agents' inputs (B, A, columns), which tell it at their end where the wiring is masked."""
        return self._shared_masks(rows[:, :, -self.columns.mask :] > 0)

    def _shared_masks(self, masks: BoolArray) -> BoolArray:
        """The agents' masks (B, A, k) by rows."""
        shared = masks.reshape(len(masks) * self.rows, -1)
        return flat_masks(shared, self.choices * self.together) if self.wiring.flat else shared

    def active(self, seen: Seen, state: State) -> BoolArray:
        """The agents (B, A) whose action has an effect now."""
        return self.adapter.active(seen, state[OWN:])

    def keep(self, seen: Seen, state: State, actions: Array) -> State:
        """The state with new actions (B, A, ...) where the agents decide now; elsewhere the old ones stay.

        Agents that are not active take the neutral action, whatever a network says, but for plain wirings.
        """
        row, averages, rough, kept, age, *own = state
        ones = (1,) * (kept.ndim - 2)
        acting = self.wiring.plain or self.active(seen, state).reshape(*kept.shape[:2], *ones)
        chosen = np.where(acting, actions, self._neutral)
        return row, averages, rough, np.where(self.due(seen, state).reshape(-1, 1, *ones), chosen, kept), age, *own

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The role's action (B, ...) that follows from the kept ones, and the next state."""
        *mine, kept, age = state[:OWN]
        action, own = self.adapter.act(seen, state[OWN:], kept)
        return action, (*mine, kept, age + 1, *own)


@kernel
def average(row: Observation, first: BoolArray, gains: FloatArray, averages: Observation) -> None:
    """Bring running averages (B, A, k, n) up to date with rows (B, A, n), which they begin with where `first` (B,)."""
    for b in range(row.shape[0]):
        for a in range(row.shape[1]):
            for k in range(gains.size):
                gain = 1.0 if first[b] else gains[k]
                for i in range(row.shape[2]):
                    averages[b, a, k, i] += np.float32(gain * (row[b, a, i] - averages[b, a, k, i]))


@kernel
def fill_inputs(
    row: Observation,
    averages: Observation,
    rough: Observation,
    kept: Array,
    age: IntArray,
    mean: Observation,
    scale: Observation,
    choices: IntArray,
    inputs: Observation,
) -> None:
    """Fill inputs (B, A, k): what is seen (B, A, m), its averages (B, A, n, m), that of changes, and kept actions.

    The first ones become (value - mean) * scale, within `CLIP`, where there is a scale (k,). Actions (B, A, j) are
    one-hot for each discrete entry of so many `choices` (j,), else as they are; zeros at the start of an episode.
    """
    size = row.shape[2]
    scaled = size * (1 + averages.shape[2]) + rough.shape[2]
    for b in range(row.shape[0]):
        for a in range(row.shape[1]):
            for i in range(scaled):
                part, entry = i // size - 1, i % size
                if part < 0:
                    value = row[b, a, entry]
                elif part < averages.shape[2]:
                    value = averages[b, a, part, entry]
                else:
                    value = rough[b, a, entry]
                if mean.size > 0:
                    value = (value - mean[i]) * scale[i]
                inputs[b, a, i] = min(max(value, np.float32(-CLIP)), np.float32(CLIP))
            to = scaled
            for j in range(kept.shape[2]):
                if choices.size == 0:
                    inputs[b, a, to] = np.float32(kept[b, a, j]) if age[b] > 0 else np.float32(0)
                    to += 1
                else:
                    for choice in range(choices[j]):
                        chosen = age[b] > 0 and kept[b, a, j] == choice
                        inputs[b, a, to + choice] = 1 if chosen else 0
                    to += choices[j]


def action_space_of(space: spaces.Space[Any], together: int, *, flat: bool) -> spaces.Space[Any]:
    """The actions of a row in which so many agents act together, each in `space`.

    Raises:
        ConfigurationError: `flat` asks for too many actions, or for one number where actions are continuous.
    """
    choices = choices_of(space)
    if together > 1 and choices:
        space = spaces.MultiDiscrete(list(choices * together))
    elif together > 1:
        space = spaces.Box(-1.0, 1.0, (together * int(np.prod(space.shape or ())),), np.float32)
    return flattened(space) if flat else space
