"""The closed loop in one kernel gives the episodes of a match."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding.string_controller import SHAPE, StringController, StringLoop, shipped_gains
from cps_envs.core.play import play_episodes
from cps_envs.disbanding.problem import DISBANDING

ONE, TWO, THREE = "lead", "table_2_3", "timed?pause_s=5"
RELAYED = {"quiet_share": 0.0, "earliest_attack_s": 1}
NOISY = {"report": "safety", "correction_noise_mps2": 0.8}
CASES = {
    "one attack, paper": ("paper", {"tau_s": 0.1, "duration_s": 60.0}, ONE, "informed"),
    "two attacks, paper": ("paper", {"tau_s": 0.5, "desired_gap_m": 4.0, "duration_s": 130.0}, TWO, "informed"),
    "own detection": ("easy", {"duration_s": 60.0}, THREE, "local"),
    "noise": ("easy", {**NOISY, "duration_s": 60.0}, THREE, "informed"),
    "relayed, with jams": ("learning", {**RELAYED, "duration_s": 60.0}, "timed?pause_s=20&jam=2", "warned"),
    "platoons drawn": ("easy", {"num_platoons": (4, 8), "duration_s": 60.0}, "random", "local"),
    "the end at a collision": ("easy", {"on_collision": "end", "duration_s": 60.0, "tau_s": 0.5}, THREE, "informed"),
}


def both(case: str, spoilt: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a match and the loop end with; gains are spoilt by up to this factor, differently for each episode."""
    preset, overrides, attacker, form = CASES[case]
    config, seeds = DISBANDING.config(preset, overrides), [3, 4, 5]
    generator = np.random.default_rng(0)
    gains = shipped_gains(form)[0] * generator.uniform(1 - spoilt, 1 + spoilt, (len(seeds), *SHAPE))
    thresholds = shipped_gains(form)[1] * generator.uniform(0.5, 1.5, len(seeds))
    policy = StringController(
        DISBANDING.game(config, 1).spec("defender"), form=form, gains=gains, detection_mps=thresholds
    )
    if spoilt == 0:
        policy = StringController(DISBANDING.game(config, 1).spec("defender"), form=form)
    looped = replace(DISBANDING, game=lambda config, num_envs: StringLoop(config, num_envs, policy))
    match = play_episodes(DISBANDING, config, {"attacker": attacker, "defender": policy}, seeds)
    return match, play_episodes(looped, config, {"attacker": attacker}, seeds)


# Rows of gains belong to places in a batch, which shrinks in a match where episodes end early: `Members` sees to that.
PLAYED = [(case, spoilt) for case in CASES for spoilt in (0.0, 0.5) if not (spoilt and "the end" in case)]


@pytest.mark.parametrize(("case", "spoilt"), PLAYED)
def test_the_loop_is_the_match(case: str, spoilt: float) -> None:
    match, loop = both(case, spoilt)
    assert match.keys() == loop.keys()
    for name, values in match.items():
        np.testing.assert_allclose(loop[name], values, rtol=0, atol=1e-12, err_msg=name)


def test_the_cases_hold_collisions_and_safe_episodes() -> None:
    collided = [both("own detection", spoilt)[0]["collided_intact"] for spoilt in (0.0, 0.5)]
    assert np.any(np.concatenate(collided) > 0)
    assert np.any(np.concatenate(collided) == 0)
