"""`python -m tools.rogue.span`: what accelerations are worth to the defender of preset `learning`.

The span is what the best policy that never looks lets the attacker be paid, less what the best answer known to each
attacker does: the room for learning. It is measured where the defender may choose laws only, and where it may choose
accelerations too, on the same episodes against the panel of the track rogue-defense.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import typer

from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.console import note, out
from cps_agents.sheet import Sheet
from cps_baselines.rogue.informed import responses
from cps_baselines.tracks import find_track, written
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import FloatArray, Role
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE
from tools.command import run
from tools.rivals.constants import constants_of
from tools.rivals.rogue import RIVALS

TRACK = find_track("rogue-defense")
FORMS = {"laws": "mode", "laws and accelerations": "either"}  # what the defender chooses
CHOSEN, JUDGED = 92_000_000, 93_000_000  # first seeds
BLOCK = 100_000  # seeds of each attacker
ROUNDS = ((4, 12), (32, 1))  # episodes against each attacker, and how many policies stay


def blind(config: RogueConfig) -> list[str]:
    """Policies that never look."""
    own = constants_of(ROGUE.game(config, 1).spec("defender"), "vehicle")
    return ["none", "random", *RIVALS["defender"].constants, *own]


def known(config: RogueConfig) -> list[str]:
    """Policies that look, told or not, as far as they can play; of networks none, since no laws alone were learned."""
    rivals, game = RIVALS["defender"], ROGUE.game(config, 1)
    told = [written("informed", **laws) for laws in responses().values()]
    every = dict.fromkeys([*(each.reference for each in (*rivals.policies, *rivals.informed)), *told])
    return [policy for policy in every if _plays(policy, game)]


def _plays(policy: str, game: Game) -> bool:
    try:
        ROGUE.policy(policy, game, "defender")
    except ConfigurationError:
        return False
    return True


def pays(policies: Sequence[str], config: RogueConfig, first: int, episodes: int) -> FloatArray:
    """What each attacker of the panel is paid (attackers, episodes) by the defender at its place."""
    found = []
    for place, (policy, rival) in enumerate(zip(policies, TRACK.panel, strict=True)):
        players: dict[Role, PolicyReference] = {"attacker": rival.policy, "defender": policy}
        seeds = range(first + place * BLOCK, first + place * BLOCK + episodes)
        found.append(play_episodes(ROGUE, config, players, seeds)["return"])
    return np.array(found)


def chosen(policies: Sequence[str], config: RogueConfig, *, for_each: bool) -> list[str]:
    """The policy that lets the attackers be paid least: one for all of them, or one for each."""
    left, weights = list(policies), np.array(TRACK.shares)
    for episodes, stay in ROUNDS:
        paid = np.array([pays([each] * len(weights), config, CHOSEN, episodes).mean(axis=1) for each in left])
        columns = paid if for_each else np.outer(paid @ weights, np.ones(len(weights)))
        ranking = columns.argsort(axis=0)[:stay]
        best = [left[place] for place in ranking[0]]
        left = [left[place] for place in np.unique(ranking)]
    return best


def span(
    episodes: Annotated[int, typer.Option(min=16, help="Judge on so many against each attacker.")] = 512,
) -> None:
    """Say how far laws alone, and accelerations too, leave the defender room for learning."""
    rows, rooms, weights = [], [], np.array(TRACK.shares)
    for name, form in FORMS.items():
        config = ROGUE.config("learning", {"defense_action": form})
        sides = [chosen(blind(config), config, for_each=False), chosen(known(config), config, for_each=True)]
        paid = [pays(policies, config, JUDGED, episodes) for policies in sides]
        rooms.append(len(weights) * weights[:, np.newaxis] * (paid[0] - paid[1]))  # the mean over strata weighs alike
        room = estimate([row[np.newaxis] for row in rooms[-1]])
        without, best = (float(weights @ each.mean(axis=1)) for each in paid)
        rows.append((name, f"{without:.2f}", f"{best:.2f}", _interval(room)))
        note(f"{name}: {sides[0][0]}; {', '.join(sides[1])}")
    title = "Preset learning: what the attackers of rogue-defense are paid, m/s"
    out().print(Sheet(title, ("the defender chooses", "best that never looks", "best known answers", "span"), rows))
    more = estimate([row[np.newaxis] for row in rooms[1] - rooms[0]])
    out().print(f"Accelerations change the span by {_interval(more)} m/s.")


def _interval(found: Estimate) -> str:
    return f"{found.mean:.2f} ({found.low:.2f} to {found.high:.2f})"


if __name__ == "__main__":
    run(span, "python -m tools.rogue.span")
