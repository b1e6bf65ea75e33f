"""Cards of strangers that name cards: a policy is found within a budget of look-ups, or refused in one sentence."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from cps_agents.zoo.mixing import save_mixture
from cps_agents.zoo.references import weights_of
from cps_baselines.arena import Venue
from cps_envs import find_problem
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import resolve_policy

VENUE = Venue("rogue", "easy")
SPEC = find_problem("rogue").game(VENUE.config, 1).spec("attacker")
MOST_CPU_S = 2.0


def write_mixture(path: Path, *references: str) -> str:
    save_mixture(path, VENUE, "attacker", dict.fromkeys(references, 1.0 / len(references)), {}, {}, "by hand")
    return f"zoo:{path}"


def doubling(folder: Path, levels: int) -> str:
    """The reference of a card that leads to 2 ** levels look-ups."""
    reference = "square"
    for level in range(levels):
        twice = f'mixture?policies=["{reference}","{reference}"]'
        reference = write_mixture(folder / f"l{level}.json", twice)
    return reference


@pytest.mark.parametrize("kind", ["doubling", "itself", "wide"])
def test_a_card_that_names_too_much_is_refused_soon(kind: str, tmp_path: Path) -> None:
    leaf = write_mixture(tmp_path / "leaf.json", "square")
    if kind == "doubling":
        reference = doubling(tmp_path, 25)
    elif kind == "itself":
        reference = write_mixture(tmp_path / "self.json", f'mixture?policies=["zoo:{tmp_path}/self.json"]')
    else:
        names = ",".join([f'"{leaf}"'] * 5000)
        reference = write_mixture(tmp_path / "wide.json", f"mixture?policies=[{names}]")
    begun = time.process_time()
    with pytest.raises(ConfigurationError, match=r"\.json|mixture"):
        resolve_policy(reference, SPEC)
    assert time.process_time() - begun < MOST_CPU_S


def test_the_files_behind_a_card_are_looked_at_once(tmp_path: Path) -> None:
    begun = time.process_time()
    assert len(weights_of(doubling(tmp_path, 25))) == 25
    name = tmp_path / "self.json"
    assert set(weights_of(write_mixture(name, f'mixture?policies=["zoo:{name}"]'))) == {str(name)}
    assert time.process_time() - begun < 2 * MOST_CPU_S


def test_a_mixture_of_mixed_names_plays(tmp_path: Path) -> None:
    reference = write_mixture(tmp_path / "fine.json", 'mixture?policies=["square","random"]', "always?action=0")
    policy = resolve_policy(reference, SPEC)
    np.testing.assert_allclose(policy.probabilities, 0.5)  # type: ignore[attr-defined]
