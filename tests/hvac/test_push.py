"""Attackers of commands, set-points and messages, and the defender that finds them out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.hvac.monitor import Monitor
from cps_baselines.hvac.push import paid_direction
from cps_envs.core.policies.seen import Seen
from cps_envs.hvac.config import HvacConfig
from tests.hvac.games import play, spec_of, watched

NOBODY_LIES = {"compromised_weights": (1.0,)}
COMMANDS = {"command_attack_w": 300.0}
SET_POINTS = {"reference_attack_c": 2.0}
SILENCE = {"denial": ("commands",)}
SAFE = {"thermostats": True, "hysteresis_c": 1.0}
SEEDS = range(4)


def impact(attacker: str, defender: str, **config: Any) -> float:
    found: float = play(attacker, defender, SEEDS, "learning", **{**NOBODY_LIES, **SAFE, **config})["a_impact"].mean()
    return found


@pytest.mark.parametrize(
    ("attacker", "config"), [("push", COMMANDS), ("push", SET_POINTS), ("jam?hold_h=6", SILENCE)], ids=str
)
def test_the_monitor_hands_over_where_sensors_tell_nothing(attacker: str, config: dict[str, Any]) -> None:
    by_sensors = min(impact(attacker, defender, **config) for defender in ("largest", "mtd2"))
    assert impact(attacker, "monitor", **config) < 0.8 * by_sensors


@pytest.mark.parametrize("attacker", ["none", "constant", "tracker"])
def test_against_liars_the_monitor_is_largest(attacker: str) -> None:
    liars = {"compromised_weights": (0.0, 0.4, 0.4, 0.2)}
    by_monitor, by_largest = (impact(attacker, each, **liars) for each in ("monitor", "largest"))
    assert by_monitor == pytest.approx(by_largest, abs=1e-9)


def test_the_monitor_computes_what_the_controller_computes() -> None:
    """Whatever the defender chose, the integrator that it keeps is the controller's."""
    config = {**NOBODY_LIES, **SAFE, "num_steps": 400, "onset_step": 390}
    spec, differences = spec_of("defender", **config), []
    monitor = Monitor(spec)
    states = [monitor.begin([np.random.default_rng(0)], [])]

    def compare(game: Any) -> None:
        states.append(monitor.act(Seen(spec.fields, game.observe("defender")), states[-1])[1])
        differences.append(np.abs(game.state.integrator[0] - states[-1][1][0]).max())

    watched(compare, "none", "tests.hvac.players:RandomChoice", [0], **config)
    assert len(differences) == 400
    assert max(differences) < 0.5


def test_nobody_can_tell_a_covert_attack_on_all_sensors() -> None:
    """What a defender sees is what it sees on the same day without an attack, to rounding."""
    config = {
        "command_attack_w": 100.0,
        "compromised_weights": (0.0, 0.0, 0.0, 0.0, 1.0),
        "onset_step": 250,
        "model_error": 0,
    }

    def shown(game: Any) -> Any:
        return np.concatenate([game.state.reading[0], game.state.heating[0]]), game.state.temperature[0].copy()

    quiet, covert = (watched(shown, each, "largest", [1], **config) for each in ("none", "covert"))
    for (seen, _), (also_seen, _) in zip(quiet[:300], covert[:300], strict=True):
        np.testing.assert_allclose(also_seen, seen, atol=1e-9)
    assert (covert[300][1] - quiet[300][1]).min() > 0.5


def test_pushing_goes_where_it_pays() -> None:
    paid = {
        "impact": "warmer",
        "energy": "warmer",
        "discomfort": "comfort",
        (("energy_kwh", -1.0),): "colder",
        (("discomfort_h", 1.0), ("attack_kwh", 0.1)): "warmer",
    }
    for payoff, direction in paid.items():
        assert paid_direction(HvacConfig(payoff=payoff)) == direction


def test_each_direction_is_best_at_what_it_is_for() -> None:
    """Energy from heating up, and as many hours out of comfort for less impact."""
    config = {**NOBODY_LIES, **COMMANDS}
    outcome = {
        each: play(f"push?direction={each}", "none", SEEDS, "learning", **config)
        for each in ("warmer", "colder", "comfort")
    }
    kwh = {each: found["attack_kwh"].mean() for each, found in outcome.items()}
    assert kwh["warmer"] > 1.5 * max(kwh["comfort"], kwh["colder"])
    assert outcome["comfort"]["discomfort_h"].mean() > 0.6 * outcome["warmer"]["discomfort_h"].mean()
    assert outcome["comfort"]["a_impact"].mean() < 0.1 * outcome["warmer"]["a_impact"].mean()
