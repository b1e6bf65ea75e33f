"""An opponent drawn from several at the start of each episode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.generators import drawing, part_of
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.compute.streams import uniform
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import PolicyReference, resolve_policy
from cps_envs.core.policies.policy import (
    AnalyticPolicy,
    Policy,
    RoleSpec,
    ask,
    begun,
    is_decentralised,
    takes_masks,
)
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State


class Mixture(AnalyticPolicy):
    """Draws one of `policies` for each episode, with probabilities proportional to `weights` (default: equal).

    By name: `mixture?policies=["none","random"]&weights=[1,3]`. In game theory this is a mixed strategy: the other side
    does not know which policy was drawn.

    Raises:
        ConfigurationError: no policies, or weights that do not fit them.
    """

    def __init__(
        self, spec: RoleSpec, policies: Sequence[PolicyReference] = (), weights: Sequence[float] | None = None
    ) -> None:
        super().__init__(spec)
        if isinstance(policies, str) or not isinstance(policies, Sequence) or not policies:
            raise ConfigurationError('a mixture needs policies, such as mixture?policies=["none","random"]')
        try:
            shares = np.ones(len(policies)) if weights is None else np.asarray(weights, np.float64)
        except (TypeError, ValueError):
            shares = np.empty(0)
        if shares.shape != (len(policies),) or not (shares >= 0).all() or not 0 < shares.sum() < np.inf:
            raise ConfigurationError(
                f"weights = {weights} must be {len(policies)} numbers, none negative and at least one positive"
            )
        self.policies: tuple[Policy, ...] = tuple(resolve_policy(reference, spec) for reference in policies)
        self.probabilities = shares / shares.sum()
        self._known: tuple[bytes, Places] | None = None  # what was drawn last
        self._kept: Kept | None = None  # what `act` returned last
        self.bounds = self.probabilities.cumsum() / self.probabilities.cumsum()[-1]
        self.privileged = frozenset().union(*(getattr(policy, "privileged", ()) for policy in self.policies))
        self.masked = any(map(takes_masks, self.policies))
        self.decentralised = any(map(is_decentralised, self.policies))

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Draw a policy for each episode and let it begin; for the state see `StateBlock`."""
        drawn = self.draw(generators)
        rows, blocks = np.zeros(len(drawn), np.int64), np.full(len(drawn), None, object)
        places = self._places_of(drawn)
        for policy, part in places.shares:
            envs = places.order[part]
            own = begun(policy, part_of(generators, envs), [knowledge[b] for b in envs])
            rows[envs], blocks[envs] = np.arange(len(envs)), StateBlock(len(envs), own)
        return drawn, rows, blocks

    def draw(self, generators: Generators) -> Array:
        """Which policy (B,) plays each episode."""
        shares = np.empty(len(generators))
        with drawing(generators, np.arange(len(generators))) as streams:
            draw_shares(streams, shares)
        drawn: Array = self.bounds.searchsorted(shares, side="right")
        return drawn

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The actions of each environment's policy."""
        drawn, rows, blocks = state
        places = self._places_of(drawn)
        alone = len(places.shares) == 1
        states = self._states(places, rows, blocks)
        if not alone:
            seen = seen.part(places.order)
        own_blocks = np.empty_like(blocks)
        neutral = self.spec.neutral_action
        actions = np.empty((len(seen), *neutral.shape), neutral.dtype)
        for index, (policy, part) in enumerate(places.shares):
            actions[part], own = ask(policy, seen if alone else seen.part(part), states[index])
            states[index] = own
            own_blocks[part] = StateBlock(part.stop - part.start, own)
        if not alone:
            actions, own_blocks = actions[places.back], own_blocks[places.back]
        self._kept = Kept(places, own_blocks.tolist(), states)
        return actions, (drawn, places.rows_back.copy(), own_blocks)

    def _states(self, places: Places, rows: Array, blocks: Array) -> list[State | None]:
        """The state of each policy with a share, gathered anew only where it is not as `act` returned it last."""
        kept = self._kept
        if kept and kept.places is places and kept.blocks == blocks.tolist() and (rows == places.rows_back).all():
            return list(kept.states)
        rows, blocks = rows[places.order], blocks[places.order]
        return [_gather(rows[part], blocks[part]) for _, part in places.shares]

    def _places_of(self, drawn: Array) -> Places:
        """Where the environments of each policy lie; found anew only when others are drawn."""
        key = drawn.tobytes()
        if self._known is None or self._known[0] != key:
            order, places = np.argsort(drawn, kind="stable"), np.arange(len(drawn))
            counts = np.bincount(drawn, minlength=len(self.policies))
            ends = counts.cumsum()
            parts = zip(self.policies, (ends - counts).tolist(), ends.tolist(), strict=True)
            shares = [(policy, slice(start, end)) for policy, start, end in parts if end > start]
            back = np.empty_like(order)
            back[order] = places
            rows = (places - (ends - counts).repeat(counts))[back]
            self._known = key, Places(order, back, rows, shares)
        return self._known[1]


class Places(NamedTuple):
    """Which environments each policy of a mixture plays."""

    order: IntArray  # (B,) the environments, those of one policy after those of another
    back: IntArray  # (B,) where each environment comes in this order
    rows_back: IntArray  # (B,) which of its policy's environments each environment is
    shares: list[tuple[Policy, slice]]  # the part of this order that each policy plays, if any


class Kept(NamedTuple):
    """What a mixture returned last, so that it need not be gathered from what is handed back."""

    places: Places
    blocks: list[StateBlock]  # of each environment
    states: list[State | None]  # of each policy with a share


@kernel
def draw_shares(streams: Array, shares: FloatArray) -> None:
    """Fill a uniform number (B,) from each of the streams (B, 6)."""
    for b in range(shares.size):
        shares[b] = uniform(streams[b])


class StateBlock:
    """The state that a policy returned for the `size` environments that it was asked for together.

    A mixture's state is for each environment: the index of its policy, its row in a block, and that block. As long as
    the same environments are asked together, their block is handed on as it is.
    """

    def __init__(self, size: int, state: State | None) -> None:
        self.size, self.state = size, state


def _gather(rows: Array, blocks: Array) -> State | None:
    """A policy's state for k environments; zeros where there is none yet, None where all have none."""
    found = dict.fromkeys(blocks.tolist())
    known = [block for block in found if block.state is not None]
    if not known:
        return None
    whole: State = known[0].state
    if len(found) == 1 and known[0].size == len(rows) and rows.tolist() == list(range(len(rows))):
        return whole
    gathered = tuple(np.zeros((len(rows), *array.shape[1:]), array.dtype) for array in whole)
    for block in known:
        mine = blocks == block
        for target, piece in zip(gathered, block.state, strict=True):
            target[mine] = piece[rows[mine]]
    return gathered
