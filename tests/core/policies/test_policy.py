"""What an analytic policy is shown, and how it begins when nobody begins for it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import UnknownNameError
from cps_envs.core.policies.mixture import Mixture
from cps_envs.core.policies.policy import AnalyticPolicy, ask, takes_masks
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State
from tests.core.toy import ToyConfig, ToyGame

SPEC = ToyGame(ToyConfig(), 1).spec("attacker")


class Drawing(AnalyticPolicy):
    """Draws a number at each start and plays it; it remembers what it was shown."""

    last: Seen

    def begin(self, generators: Any, knowledge: Any) -> State:
        return (np.array([generator.integers(5) for generator in generators]),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        self.last = seen
        assert state is not None
        return state[0], state


class Masked(Drawing):
    masked = True


class Oracle(Drawing):
    privileged = frozenset({"model"})


def observations(num_envs: int = 3) -> Array:
    values = np.random.default_rng(1).uniform(-1, 1, (num_envs, SPEC.fields.size))
    return values.astype(np.float32)


def test_fields_are_decoded_as_they_are_asked_for() -> None:
    observation = observations()
    seen, decoded = Seen(SPEC.fields, observation), SPEC.fields.decode(observation)
    assert len(seen) == 3
    for name, values in decoded.items():
        assert name in seen
        np.testing.assert_array_equal(seen[name], values)
        assert seen[name] is seen[name]
    assert "nothing" not in seen
    with pytest.raises(UnknownNameError, match=r"no field 'rivl'\. Did you mean 'rival'"):
        seen["rivl"]


def test_a_part_shows_the_same_of_fewer_environments() -> None:
    observation = observations()
    whole = Seen(SPEC.fields, observation, np.array([True, False, True]), True, np.eye(3, dtype=bool))
    part = whole.part(np.array([0, 2]))
    np.testing.assert_array_equal(part["own"], whole["own"][[0, 2]])
    assert (len(part), part.start.tolist(), part.deterministic, part.team) == (2, [True, True], True, None)
    assert part.masks is not None
    assert part.masks.tolist() == [[True, False, False], [False, False, True]]


def test_a_policy_that_nobody_began_begins_with_seed_0() -> None:
    policy = Drawing(SPEC)
    first, state = policy.predict(observations())
    again, _ = Drawing(SPEC).predict(observations())
    assert first.tolist() == again.tolist()
    begun = policy.begin(np.random.default_rng(0).spawn(3), [{}] * 3)
    assert begun is not None
    assert first.tolist() == begun[0].tolist()
    assert policy.predict(observations(), state)[0].tolist() == first.tolist()


def test_a_privileged_policy_has_to_be_begun() -> None:
    with pytest.raises(TypeError, match=r"Oracle is privileged: it needs model of each episode.*begin\(generators"):
        Oracle(SPEC).predict(observations())
    policy = Oracle(SPEC)
    assert policy.predict(observations(), policy.begin(np.random.default_rng(0).spawn(3), [{}] * 3))


def test_masks_go_to_those_who_ask_for_them() -> None:
    class Learned:
        def predict(self, observation: Any, state: Any = None, start: Any = None, deterministic: Any = False) -> Any:
            return [deterministic], state

    class MaskedLearned(Learned):
        def predict(self, *args: Any, action_masks: Any = None) -> Any:  # type: ignore[override]
            return action_masks, None

    policies = (Masked(SPEC), Drawing(SPEC), Learned(), MaskedLearned())
    assert [takes_masks(policy) for policy in policies] == [True, False, False, True]
    seen = Seen(SPEC.fields, observations(), deterministic=True, masks=np.ones((3, 5), bool))
    masked, plain = Masked(SPEC), Drawing(SPEC)
    ask(masked, seen, None)
    ask(plain, seen, None)
    assert masked.last.masks is seen.masks
    assert plain.last.masks is None
    assert ask(Learned(), seen, None) == ([True], None)
    assert ask(MaskedLearned(), seen, None)[0] is seen.masks


def test_a_mixture_takes_policies_that_only_predict() -> None:
    class Still:
        def predict(self, observation: Any, state: Any, episode_start: Any, deterministic: bool = False) -> Any:
            return np.zeros((len(observation), *SPEC.neutral_action.shape), np.float32), None

    mixture = Mixture(SPEC, (Still(), "cps_envs.core.policies.policy:Idle"), [1, 0])
    state = mixture.begin([np.random.default_rng(b) for b in range(2)], [{}, {}])
    actions, _ = mixture.predict(np.zeros((2, SPEC.fields.size), np.float32), state, np.ones(2, np.bool_), True)
    assert not actions.any()


def test_slices_of_what_is_seen_are_decoded_with_the_whole() -> None:
    whole = Seen(SPEC.fields, observations())
    part = whole.part(slice(1, 3))
    for name in SPEC.fields.slices:
        np.testing.assert_array_equal(part[name], Seen(SPEC.fields, observations()[1:3])[name])
        assert np.shares_memory(part[name], whole[name])
