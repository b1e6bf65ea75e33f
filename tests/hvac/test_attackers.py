"""The attackers against their definitions: to the brink of a set's threshold, both signs, and how they grow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.hvac.stealthy import loss_response
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array
from cps_envs.hvac.config import LEARNING
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import sensor_sets
from tests import episodes
from tests.episodes import observed
from tests.hvac.games import play, spec_of, watched

DAYS = range(6)
FIRST = 16  # the choice that names the first filter
SIGNED = ("ramp", "root_ramp", "mimic", "brink")
SEES = {"attacker_sees_choice": True}


@pytest.mark.parametrize("count", [1, 2, 3])
def test_it_gains_more_than_the_ramp_on_the_same_days(count: int) -> None:
    brink, ramp = (play(attacker, "mtd2", DAYS, num_compromised=count)["a_impact"] for attacker in ("brink", "ramp"))
    assert (brink - ramp).mean() > 0.03 * ramp.mean()


def test_mean_residuals_stay_just_below_the_threshold() -> None:
    config = HVAC.config("paper", {"num_compromised": 3})
    alone = [sensor_sets(config).index((sensor,)) for sensor in (1, 2, 4)]
    attacker = "brink?margin_c2=0.02"
    late = episodes.watched(
        HVAC, lambda game: game.mean_residuals()[:, alone], attacker, "mtd2", DAYS, num_compromised=3
    )[300:]
    assert np.mean(np.array(late) <= config.threshold_c2) > 0.99
    assert np.mean(late) == pytest.approx(config.threshold_c2 - 0.02, abs=0.01)


def test_it_leaves_other_sensors_and_the_time_before_the_onset_alone() -> None:
    config = HVAC.config("paper", {"num_compromised": 1})
    forged = np.array(
        episodes.watched(
            HVAC, lambda game: game.state.reading != game.state.measured, "brink", "mtd2", DAYS, num_compromised=1
        )
    )
    assert not forged[: config.onset_step].any()
    assert not forged[:, :, [0, 2, 3]].any()
    assert forged[config.onset_step + 1 :, :, 1].all()


@pytest.mark.parametrize("name", SIGNED)
def test_both_signs_are_mirrored(name: str) -> None:
    """Before the clipping of readings, a warmer attack is above the truth by what a colder one is below it."""

    def see(game: HvacGame) -> Array:
        true = game.state.temperature[:, game.constants.zone]
        return np.where(game.state.compromised, game.state.reading - true, 0.0)

    config = {"compromised_weights": (0, 0, 1), "onset_step": 210, "num_steps": 260, "noise_std_c": 1e-9, **SEES}
    found = {sign: np.array(watched(see, name + sign, "model_only", [3], **config)) for sign in ("", "?warmer=true")}
    assert np.abs(found[""][-1]).max() > 0.1
    assert found[""].min() < -0.1
    assert found[""].max() < 1e-6
    if name in ("ramp", "root_ramp", "mimic"):  # the other one answers the loop
        np.testing.assert_allclose(found["?warmer=true"], -found[""], atol=1e-6)
    assert found["?warmer=true"].max() > 0.1
    assert found["?warmer=true"].min() > -1e-6


def test_a_warm_mimic_shows_a_gain_of_heat() -> None:
    spec = spec_of("attacker")
    colder, warmer = (resolve_policy(f"mimic{sign}", spec) for sign in ("", "?warmer=true"))
    seen = Seen(spec.fields, observed(spec, attack_h=3.0))
    shown = [policy.act(seen, None)[0][0, :4] for policy in (colder, warmer)]
    np.testing.assert_allclose(shown[0], -loss_response(LEARNING, 100.0)[90] / 15.0, rtol=1e-5)
    np.testing.assert_allclose(shown[1], -shown[0])


def test_the_tracker_watches_all_sensors_where_the_choice_is_hidden() -> None:
    """So against who follows the filter of all sensors, hiding it changes nothing; against others it does."""
    days = {"num_steps": 400, "onset_step": (210, 250), "compromised_weights": (0, 0, 1)}

    def paid(choice: Any, **sees: Any) -> Any:
        return play("tracker", f"always?action={choice}", range(6), "learning", **days, **sees)["return"]

    np.testing.assert_array_equal(paid(FIRST + 14), paid(FIRST + 14, **SEES))
    assert (paid(FIRST) != paid(FIRST, **SEES)).any()


def test_the_tracker_holds_its_innovations_below_its_level() -> None:
    """Against a defender who follows the filter of all sensors, beside noise of its own."""
    config = {"compromised_weights": (0, 0, 1), "onset_step": 210, "num_steps": 500}

    def held(attacker: str) -> Array:
        def see(game: HvacGame) -> Array:
            return np.where(game.state.compromised, game.state.innovation[:, 14], np.nan)

        return np.array(watched(see, attacker, f"always?action={FIRST + 14}", range(12), **config))[261:]

    for sign, attacker in ((-1, "tracker?level=0.5&noise=0"), (1, "tracker?level=0.5&noise=0&warmer=true")):
        rows = held(attacker)
        assert 0.3 < sign * np.nanmean(rows) < 0.5  # the prediction follows, so that it stays a little below
        assert np.nanstd(rows) < 0.3  # no noise of its own
    rows = held("tracker?level=0.5")
    assert 0.3 < -np.nanmean(rows) < 0.5
    assert np.nanstd(rows) == pytest.approx(1.0, abs=0.1)


def test_the_tracker_is_not_summed_up_by_a_slack_above_its_level() -> None:
    """Only noise and honest sensors raise alarms then; it does more than a ramp that a CUSUM finds out."""
    days = {"compromised_weights": (0, 1), "onset_step": 210}
    tracker, ramp = (play(name, "cusum?kappa=0.5", range(40), "learning", **days)["return"] for name in
                     ("tracker", "ramp?rate_c_per_h=3&keep_noise=true"))  # fmt: skip
    assert tracker.mean() > ramp.mean()
