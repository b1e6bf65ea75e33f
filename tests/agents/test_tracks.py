"""The eight tracks: panels with every number, seeds that nobody trains on, frozen episodes that end as they did."""

from __future__ import annotations

import inspect
from itertools import chain

import pytest

pytest.importorskip("scipy", reason="needs the baselines")

from cps_agents import score
from cps_agents.scoring import frozen
from cps_agents.scoring.frozen import described
from cps_agents.scoring.tracks import find_track, tracks
from cps_envs import Series, find_problem
from cps_envs.core.declare.seeds import MOST_RUNS, SEEDS_PER_RUN, SPLITS, TRAINING_START, score_seeds
from cps_envs.core.policies.lookup import policy_entry
from cps_envs.core.types import other
from tools.challenge.freezing import every_constant


def test_scores_have_seeds_of_their_own() -> None:
    assert SPLITS["dev"].start > TRAINING_START + MOST_RUNS * SEEDS_PER_RUN
    blocks = [score_seeds(split, place, 4096) for split in ("dev", "test") for place in range(8)]
    ends = sorted(chain.from_iterable((block[0], block[-1]) for block in blocks))
    assert ends == list(chain.from_iterable((block[0], block[-1]) for block in blocks))


LATER = {"shift"}  # options that are younger than the panels; by default nothing is as if they were not there


@pytest.mark.parametrize("name", tracks())
def test_a_panel_leaves_no_number_to_defaults(name: str) -> None:
    track = tracks()[name]
    assert 4 <= len(track.panel) <= 6
    assert len({rival.name for rival in track.panel}) == len(track.panel)
    assert sum(track.shares) == pytest.approx(1.0)
    for rival in track.panel:
        policy, _, query = rival.policy.partition("?")
        given = {pair.partition("=")[0] for pair in query.split("&")}
        if policy.startswith("zoo:"):
            assert "seed" in given
            continue
        entry = policy_entry(track.problem, other(track.role), policy)
        assert entry is not None, policy
        parameters = inspect.signature(entry.load()).parameters.values()
        numbers = {
            each.name for each in parameters if isinstance(each.default, (int, float, str)) and each.default != ""
        }
        assert numbers - {"untrained", *LATER} <= given, rival.policy  # the first chooses numbers where none are given


MOST = 12  # constants of an adapter that are scored on split dev


@pytest.mark.parametrize("name", tracks())
def test_the_frozen_episodes_end_as_they_did(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    track = find_track(name)
    monkeypatch.setattr(frozen, "REPLAYED", 2)
    known = frozen.read_frozen(track)
    known.check_game()
    assert known.span * track.sign > 0


@pytest.mark.parametrize(
    ("name", "constant"), [("fdi-attack", "motion&action=7"), ("rogue-defense", "give_way&action=1")]
)
def test_constants_of_the_adapter_are_among_those_that_do_not_look(name: str, constant: str) -> None:
    assert f"always?adapter={constant}" in every_constant(find_track(name))
    assert not [each for each in every_constant(find_track("disbanding-defense")) if "adapter=follow" in each]


@pytest.mark.slow
@pytest.mark.parametrize("name", tracks())
def test_constants_and_random_stay_at_zero(name: str) -> None:
    """Constants of the adapter are no better than the best one, on the same few episodes, which may be kind to all."""
    track = find_track(name)
    best = frozen.read_frozen(track).zero_policy
    for policy in (best, "random", "none"):
        found = score(name, policy)
        assert found.estimate.mean <= found.half_width, policy
    zero = score(name, best, split="dev")
    for policy in [each for each in every_constant(track) if "adapter=" in each][:MOST]:
        gain = score(name, policy, split="dev").minus(zero)
        assert gain.low is not None
        assert gain.low <= 0.0, policy


def test_a_field_that_came_after_the_freeze_counts_where_it_has_not_its_default() -> None:
    before = described(find_problem("rogue").config("learning", {}))
    assert "leader_speed_mps" not in before
    assert "power_ratio=" in before
    driven = Series((20.0, 25.0), step_s=60.0, repeats=True)
    assert (
        described(find_problem("rogue").config("learning", {"leader_speed_mps": driven}))
        == f"{before[:-1]}, leader_speed_mps={driven!r})"
    )
