"""The searched attacker `switching`: what its file says, and what its weights do."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from cps_paper.rogue.headroom import SHIPPED
from cps_paper.rogue.worlds import ALL, RATIOS, switching_damages
from tests.rogue.games import DEFENDERS


def shipped() -> list[dict[str, Any]]:
    return json.loads(files("cps_baselines.rogue").joinpath("switching.json").read_text(encoding="utf-8"))["found"]


def test_against_all_means_the_mean_over_the_six_defenders() -> None:
    weights = np.array([[1.34, 0.16, -0.69, 4.35, -0.14, -0.47, -0.71]])
    together = switching_damages(weights, DEFENDERS, 1.3, [0], spread=0.0)[0, :, 0]
    for defender, damage in zip(DEFENDERS, together, strict=True):
        alone = switching_damages(weights, (defender,), 1.3, [0], spread=0.0)
        assert alone.ravel() == pytest.approx(damage, abs=1e-9)
    assert together[0] == pytest.approx(120.6, abs=0.06)  # the check value of the specification


def test_the_shipped_file_is_complete_and_says_how_it_was_found() -> None:
    rows = shipped()
    assert [(row["against"], row["power_ratio"]) for row in rows] == [
        (name, ratio) for name in (ALL, *DEFENDERS) for ratio in RATIOS
    ]
    for row in rows:
        general = next(each for each in rows if (each["against"], each["power_ratio"]) == (ALL, row["power_ratio"]))
        assert row["search"]["start"] == ([] if row["against"] == ALL else general["weights"])


@pytest.mark.parametrize("row", shipped(), ids=lambda row: f"{row['against']}-{row['power_ratio']}")
def test_the_shipped_weights_do_what_the_file_says(row: dict[str, Any]) -> None:
    against = DEFENDERS if row["against"] == ALL else (row["against"],)
    found = switching_damages(np.array([row["weights"]]), against, row["power_ratio"], [0], spread=0.0).mean()
    assert found == pytest.approx(row["damage"], rel=0.05)


def test_they_reach_what_another_search_found() -> None:
    """The bar: the best of three cross-entropy searches of an independent implementation, verified as ours is."""
    bars = {(row["defender"], float(row["power_ratio"])): float(row["verified"]) for row in SHIPPED}
    for row in shipped():
        if row["against"] != ALL:
            assert row["verified"] >= 0.95 * bars[row["against"], row["power_ratio"]], row["against"]
