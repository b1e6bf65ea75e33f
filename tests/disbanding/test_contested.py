"""The policies of the preset `learning`: timed attacks, own detection, the searched controller, the reference."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding.families import OTHER
from cps_baselines.disbanding.string_controller import SHAPE, Gains, StringController, shipped_gains
from cps_baselines.disbanding.timed import distinct
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.problem import DISBANDING
from tests import episodes

OPEN = {"quiet_share": 0.0, "earliest_attack_s": 1, "attack_budget": 3, "jam_budget_s": 4}
UNSEEN = range(700_000, 700_100)  # neither tuned on nor searched with
play = partial(episodes.play, DISBANDING, preset="learning")
spec_of = partial(episodes.spec_of, DISBANDING, preset="learning")


def moves(attacker: str, defender: str = "none", **overrides: Any) -> tuple[Any, ...]:
    """When the platoons of one episode are disbanded {platoon: s}, and where the radio is blocked [(s, link)]."""
    jams, last = [], {}

    def look(game: DisbandingGame) -> None:
        place = int(game.state.jam_place[0])
        if game.elapsed[0] % 10 == 0 and place >= 0:
            jams.append((round(game.elapsed[0] / 10), place + 1))
        last["times"] = game.state.disbanding_s[0].copy()

    play(attacker, defender, [5], on_step=look, **{**OPEN, "control_period_s": 0.1, "duration_s": 60.0} | overrides)
    return {10 - p: t for p, t in enumerate(last["times"]) if np.isfinite(t)}, jams


def test_a_timed_attack_keeps_its_times() -> None:
    assert moves("timed?pause_s=20")[0] == {10: 1.0, 9: 21.0, 8: 41.0}
    assert moves("timed?first=2&second=2&third=2&delay_s=3&pause_s=10")[0] == {9: 4.0, 8: 14.0, 7: 24.0}
    assert moves("timed?pause_s=50&by_s=30")[0] == {10: 1.0, 9: 30.0, 8: 35.0}  # 5 s later is legal
    assert moves("timed?pause_s=20", earliest_attack_s=7, attack_budget=2)[0] == {10: 7.0, 9: 27.0}


def test_a_jam_comes_before_or_after_its_attack() -> None:
    attacks, jams = moves("timed?pause_s=20&jam=2&jam_s=-2")
    assert attacks == {10: 3.0, 9: 23.0, 8: 43.0}  # put off by the jam
    assert jams == [(second, 2) for second in (2, 3, 4)]  # seen at whole seconds; on from 1 s for 4 s
    attacks, jams = moves("timed?pause_s=20&jam=3&jam_s=5&jam_at=2")
    assert attacks == {10: 1.0, 9: 21.0, 8: 41.0}
    assert jams == [(second, 3) for second in (27, 28, 29)]


def test_the_adaptive_attacker_tells_defenders_apart() -> None:
    knobs = "slow_s=40&middle_s=45&fast_s=50"
    undefended, defended = (moves(f"adaptive?{knobs}", defender)[0] for defender in ("none", "informed"))
    assert undefended[10] == defended[10] == 1.0
    assert undefended[9] == 41.0
    assert defended[9] == 51.0


def test_places_are_made_distinct() -> None:
    assert distinct([1, 1, 1], 10).tolist() == [1, 2, 3]
    assert distinct([9.6, 10, 3.2], 10).tolist() == [10, 1, 3]
    with pytest.raises(ConfigurationError, match="platoon 11"):
        distinct([11], 10)


def observed(**overrides: Any) -> Array:
    """Observations in the middle of an attack, (2, size), and the game."""
    found = {}

    def look(game: DisbandingGame) -> None:
        if game.elapsed[0] == 150:
            found["rows"] = game.observe("defender")

    play("lead", "none", [1, 2], on_step=look, duration_s=20.0, **{**OPEN, **overrides})
    return found["rows"]


def test_the_searched_controller_is_its_formula() -> None:
    spec, rows = spec_of("defender"), observed()
    generator = np.random.default_rng(0)
    gains = np.array(OTHER) + 0.1 * generator.standard_normal(SHAPE)
    policy = StringController(spec, gains=gains)
    actions, _ = policy.predict(rows)
    v = {name: value[0] for name, value in spec.fields.decode(rows).items()}
    checked = 0
    for q in np.flatnonzero((v["mitigable"][10:] > 0.5) & (v["warned"] > 0.5)) + 10:
        g = Gains(*gains[0 if q % 10 == 0 else 1])
        u = g.gap * np.clip(v["gap"][q - 1] - g.wanted_m - g.headway_s * v["speed"][q], -g.reach_m, g.reach_m)
        u += (g.closing + g.closing_lag * v["tau_s"]) * v["relative_speed"][q - 1]
        u += (g.predecessor + g.predecessor_lag * v["tau_s"]) * v["acceleration"][q - 1] + g.own * v["acceleration"][q]
        ahead = g.ahead_closing * (v["ahead_speed"][q - 10] - v["speed"][q])
        ahead += g.ahead_acceleration * v["ahead_acceleration"][q - 10] + g.ahead_command * v["ahead_command"][q - 10]
        u += ahead / (1 + g.forgetting * v["record_age_s"][q - 10])
        u = min(u, g.cap * (31 + g.excess_mps - v["speed"][q]))
        u += g.predecessor_command * (v["law_command"][q - 1] + 6 * actions[0, q - 1])
        expected = np.clip((u - (1 + g.law) * v["law_command"][q]) / 6, -1, 1)
        assert actions[0, q] == pytest.approx(expected, abs=1e-4)
        checked += 1
    assert checked > 50
    assert np.all(actions[0, 10:][v["warned"] < 0.5] == 0)


@pytest.mark.parametrize("defender", ["copy", "feedback", "string", "local"])
def test_a_vehicle_acts_on_itself_its_predecessor_and_its_record(defender: str) -> None:
    spec, rows = spec_of("defender"), observed()
    changed, q = rows.copy(), 43
    own = {"speed": (q, q - 1), "acceleration": (q, q - 1), "law_command": (q,), "mitigable": (q,)}
    own |= {"gap": (q - 1,), "relative_speed": (q - 1,)}
    own |= dict.fromkeys(
        ("warned", "record_age_s", "ahead_speed", "ahead_acceleration", "ahead_command", "ahead_distance"), (q - 10,)
    )
    for name, part in spec.fields.slices.items():
        others = [i for i in range(part.stop - part.start) if i not in own.get(name, ())]
        if name not in ("tau_s", "desired_gap_m"):
            changed[:, part.start + np.array(others, int)] *= -0.5
    policy = resolve_policy(defender, spec)
    before, after = (policy.predict(shown)[0][:, q] for shown in (rows, changed))
    assert np.array_equal(before, after)
    assert (before != 0).any()


def test_own_detection_needs_a_slow_neighbour_and_outlasts_it() -> None:
    spec = spec_of("defender")
    rows = observed(hop_delay_s=2.0)
    part = spec.fields.slices["speed"]
    middle, half = spec.fields.scale[:, part]
    calm = rows.copy()
    calm[:, part] = (31.0 - middle) / half
    calm[:, spec.fields.slices["warned"]] = -1.0
    slow = calm.copy()
    slow[:, part.start + 40] = ((29.0 - middle) / half)[40]
    policy = resolve_policy("feedback?detection_mps=1.5&hold_s=0.3", spec)
    state, alarmed = None, []
    for shown in (calm, slow, calm, calm, calm, calm):
        actions, state = policy.predict(shown, state)
        alarmed.append(np.flatnonzero(actions[0]).tolist())
    assert alarmed == [[], [40, 41], [40, 41], [40, 41], [], []]
    deaf = resolve_policy("feedback?detection_mps=2.5", spec)
    assert not deaf.predict(slow)[0].any()
    always = resolve_policy("string?form=local&detection_mps=0", spec)
    assert np.count_nonzero(always.predict(calm)[0]) > 50
    with pytest.raises(ConfigurationError, match="detection_mps"):
        resolve_policy("feedback?detection_mps=-1", spec)


def test_a_jam_does_not_concern_who_believes_no_radio() -> None:
    short = {**OPEN, "duration_s": 30.0}
    quiet, jammed = (play(f"timed?delay_s=5&jam={jam}&jam_s=2", "local", range(3), **short) for jam in (0, 1))
    assert np.array_equal(quiet["return"], jammed["return"])


def test_the_reference_is_told_at_once() -> None:
    setting = OPEN | {"attack_budget": 2}
    spec, shown = spec_of("defender", **setting), []
    policy = resolve_policy("informed", spec)

    def look(game: DisbandingGame) -> None:
        if game.elapsed[0] == 150:
            told = [game.truth(b) for b in range(2)]
            truth = {name: np.stack([t[name] for t in told]) for name in told[0]}
            rows = policy._corrected(game.observe("defender"), truth)
            shown.append((spec.fields.decode(rows), {name: part.copy() for name, part in truth.items()}))

    play("timed?pause_s=8", "none", [1, 2], on_step=look, duration_s=20.0, **setting)
    ((view, truth),) = shown
    assert truth["disbanding_s"][0, :3].tolist() == [1.0, 9.0, np.inf]
    assert np.all(view["warned"] > 0.5)
    assert np.allclose(view["record_age_s"], 0, atol=1e-4)
    for name, unit in (("speed", 1e-4), ("acceleration", 1e-4)):
        known = truth[name]
        assert np.allclose(view[f"ahead_{name}"][:, :10], known[:, [9]], atol=unit)  # platoon 9 hears of platoon 10
        assert np.allclose(view[f"ahead_{name}"][:, 10:], known[:, [19]], atol=unit)


def test_nobody_ahead_is_disbanded_means_nothing_is_told() -> None:
    spec, rows = spec_of("defender"), observed()
    quiet = {name: np.zeros((2, 100)) for name in ("position", "speed", "acceleration", "command")}
    quiet["disbanding_s"] = np.full((2, 10), np.inf)
    assert np.array_equal(resolve_policy("informed", spec)._corrected(rows, quiet), rows)


def test_old_defenders_wait_for_the_warning() -> None:
    rows = observed(hop_delay_s=1.0, hop_loss=0.3)
    spec = spec_of("defender")
    warned = Seen(spec.fields, rows)["warned"] > 0.5
    for name in ("heuristic", "mpc", "copy", "feedback"):
        actions, _ = resolve_policy(name, spec).predict(rows)
        assert not actions[:, 10:][~warned].any(), name


def test_shipped_numbers_of_every_form_are_there() -> None:
    for form in ("warned", "local", "informed"):
        gains, threshold = shipped_gains(form)
        assert gains.shape == SHAPE
        assert threshold > 0
    with pytest.raises(ConfigurationError, match="locall"):
        StringController(spec_of("defender"), form="locall")
    with pytest.raises(ValueError, match=r"\(2, 17\)"):
        StringController(spec_of("defender"), gains=np.zeros((2, 15)))


@pytest.mark.slow
def test_no_detector_cries_wolf_in_honest_episodes() -> None:
    for defender in ("string", "local"):
        outcome = play("none", defender, UNSEEN)
        assert outcome["false_alarms"].mean() < 5.0, defender
        assert outcome["collided_intact"].sum() == 0, defender
        assert outcome["return"].mean() < play("none", "none", UNSEEN)["return"].mean() + 0.5, defender


@pytest.mark.slow
def test_late_warnings_cost_and_the_search_wins_most_of_it_back() -> None:
    attack = "timed?jam=1"
    returns = {name: play(attack, name, UNSEEN)["return"] for name in ("none", "feedback", "string", "informed")}
    means = {name: values.mean() for name, values in returns.items()}
    assert means["informed"] + 0.5 < means["string"] < min(means["feedback"], means["none"]) - 5
    lost = returns["string"] - returns["informed"]
    assert lost.mean() > 2 * lost.std(ddof=1) / np.sqrt(len(lost))


@pytest.mark.slow
def test_a_jam_is_worth_something_to_the_attacker() -> None:
    for defender in ("copy", "feedback", "string"):
        jammed, free = (play(f"timed?jam={jam}", defender, UNSEEN)["return"] for jam in (1, 0))
        gain = jammed - free
        assert gain.mean() > 2 * gain.std(ddof=1) / np.sqrt(len(gain)), defender
