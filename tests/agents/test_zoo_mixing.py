"""Mixed strategies as policies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")

from cps_agents.errors import CommandError
from cps_agents.league.self_play_report import ship_mixtures
from cps_agents.zoo.mixing import save_mixture
from cps_agents.zoo.references import weights_of
from cps_baselines.arena import Venue
from cps_envs.core.errors import ConfigurationError
from cps_envs.registration import find_problem
from tests.agents.command_line import succeeded
from tests.agents.trained import save_tiny
from tests.episodes import play

SHORT = {"duration_s": 3.0}
VENUE = Venue("rogue", "easy", SHORT)


def returns(attacker: str, defender: str, seeds: range) -> Any:
    return play(find_problem("rogue"), attacker, defender, seeds, "easy", **SHORT)["return"]


def test_a_mixed_strategy_is_a_policy_with_its_parts(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    save_tiny(tmp_path / "run" / "policy.json", "rogue", "defender", preset="easy", overrides=SHORT, seeds=1)
    strategy = {"pd": 0.25, f"zoo:{tmp_path}/run": 0.75}
    target = tmp_path / "zoo" / "mixed.json"
    target.parent.mkdir()
    card = save_mixture(target, VENUE, "defender", strategy, {"steps": 1}, {}, "cps-envs self-play rogue")
    part = f"zoo:{target.parent}/parts/mixed-2.json"
    assert card.numbers == ("pd", part)
    text = f'mixture?policies=["pd","{part}"]&weights=[0.25,0.75]'
    np.testing.assert_array_equal(returns("square", f"zoo:{target}", range(6)), returns("square", text, range(6)))
    assert {str(target), f"{target.parent}/parts/mixed-2.json"} == set(weights_of(f"zoo:{target}"))
    again = tmp_path / "zoo" / "again.json"
    nested = {f"zoo:{target}": 1.0}
    with pytest.raises(CommandError, match="is a mixture itself"):
        save_mixture(again, VENUE, "defender", nested, {}, {}, "")


def test_a_card_that_mixes_mixtures_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mixed.json"
    save_mixture(path, VENUE, "defender", {"pd": 1.0}, {}, {}, "")
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, "numbers": [f"zoo:{path}"]}))
    with pytest.raises(ConfigurationError, match="a mixture itself"):
        returns("square", f"zoo:{path}", range(1))


def test_final_strategies_of_self_play_are_shipped(tmp_path: Path) -> None:
    bound = {"mean": 1.0, "low": 0.5, "high": 1.5, "seeds": 1, "episodes": 4}
    profile = {
        "attacker": {"policies": ["square", "none"], "probabilities": [0.5, 0.5]},
        "defender": {"policies": ["pd"], "probabilities": [1.0]},
    }
    document = {
        "command": "cps-envs self-play rogue --iterations 2 --out somewhere --meetings there",
        "game": {"venue": {"problem": "rogue", "preset": "easy", "overrides": SHORT}},
        "budget": {"iterations": 2, "steps": 10, "cpu_s": 3.5},
        "final": {"profile": profile, "bounds": dict.fromkeys(("secured", "conceded", "exploitability"), bound)},
    }
    (tmp_path / "self-play.json").write_text(json.dumps(document))
    cards = ship_mixtures(tmp_path / "self-play.json", tmp_path / "zoo")
    assert [card.name for card in cards] == ["rogue-attack-mixture", "rogue-defense-mixture"]
    assert cards[0].command == "cps-envs self-play rogue --iterations 2"
    assert cards[1].evaluation["self-play"]["conceded, against all policies found"]["mean"] == 1.0
    places = [f"zoo:{tmp_path}/zoo/{card.name}.json" for card in cards]
    assert np.isfinite(returns(*places, range(2))).all()
    assert "square" in succeeded("zoo", "show", f"{tmp_path}/zoo/rogue-attack-mixture.json").stdout
