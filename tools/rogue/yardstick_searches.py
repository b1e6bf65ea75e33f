"""The pieces of work behind `yardsticks`: three searches as in `switching_search`, and preset `learning`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from cps_baselines.rogue.beam import BEAMS, BeamPlanner, plan_by_beam
from cps_baselines.rogue.identify import Identify, Known, known
from cps_baselines.rogue.probing import trace_of
from cps_baselines.rogue.switching import SIZE, Switching, shipped_weights
from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference, resolve_policy
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Role, State
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE
from cps_paper.rogue.worlds import REPORTED, world_config
from tools.evolving import evolve
from tools.rivals.rogue import ATTACKERS
from tools.rogue.switching import SEARCHED, SELECTED, SwitchingSearch, search_switching

Found = dict[str, Any]
PROBE = "disband_4"  # chosen: the law against it is told apart by all six within `PROBE_S`
PROBE_S = 5.2
SCREENED, JUDGED, VERIFIED = 4, 8, 16  # worlds
SIZES = {"generations": 10, "population": 16, "restarts": 1, "worlds": 2, "finalists": 8}
CHOSEN, SHOWN = range(80_000_000, 80_000_024), range(81_000_000, 81_000_012)  # episodes of preset `learning`
CONTESTED_WIDTH = 96  # of the beams there


def search_law(defender: str, ratio: float) -> Found:
    """The best switching law: searched from zero and from the best of all laws that came with the package."""
    search = SwitchingSearch(defender, ratio)
    laws = np.array([*shipped_weights().values(), *known().weights])
    screened = search.damages(laws, SELECTED - SCREENED, SCREENED).mean(axis=(1, 2))
    start = laws[int(screened.argmax())]
    found = search_switching(SwitchingSearch(defender, ratio, **SIZES, start=tuple(start.tolist())))
    pair = np.array([found["weights"], np.round(start, 4)])
    judged = search.damages(pair, SELECTED, JUDGED, refined=True).mean(axis=(1, 2))
    weights = pair[int(judged.argmax())]
    worlds = search.damages(weights[np.newaxis], REPORTED, VERIFIED, refined=True)
    return {"weights": weights.tolist(), "damage": _rounded(worlds)}


def search_answer(defender: str, ratio: float, law: Sequence[float]) -> Found:
    """The law that hurts this controller most after the probe, and what the probe shows of it; begins at `law`."""
    origins = [np.array(law) * np.sqrt(SIZE) / np.linalg.norm(law), np.zeros(SIZE)]
    champions = [np.array(law)]
    for run, origin in enumerate(origins):

        def judge(candidates: FloatArray, generation: int, run: int = run) -> FloatArray:
            first = SEARCHED + (run * SIZES["generations"] + generation) * SIZES["worlds"]
            damages = _answered(candidates, defender, ratio, range(first, first + SIZES["worlds"]))
            means: FloatArray = damages.mean(axis=1)
            return means

        sizes = {"population": SIZES["population"], "generations": SIZES["generations"]}
        champions += [weights for _, weights in evolve(judge, origin, 0.5 + 0.5 * run, **sizes, seed=[7, run])][-4:]
    judged = _answered(np.array(champions), defender, ratio, range(SELECTED, SELECTED + JUDGED)).mean(axis=1)
    return {"weights": np.round(champions[int(judged.argmax())], 4).tolist(), "trace": _trace(defender, ratio)}


def identified(ratio: float, answers: dict[str, Found]) -> dict[str, dict[str, float]]:
    """Damages of the attacker that probes and answers: `told` the controller, and `untold`, by what the probe shows."""
    weights, traces = (np.array([found[name] for found in answers.values()]) for name in ("weights", "trace"))
    knowledge = Known(tuple(answers), weights, traces, _probe(ratio), PROBE_S)
    config = world_config(ratio, refined=True)
    spec, worlds = ROGUE.game(config, 1).spec("attacker"), range(REPORTED, REPORTED + VERIFIED)
    untold = Identify(spec, knowledge)
    told = [Identify(spec, knowledge, np.full(VERIFIED, row)) for row in range(len(answers))]
    return {
        "untold": {name: _rounded(_damages(untold, name, config, worlds)) for name in answers},
        "told": {name: _rounded(_damages(one, name, config, worlds)) for name, one in zip(answers, told, strict=True)},
    }


def plan_attack(defender: str, ratio: float) -> Found:
    """Of the plans of all beams for the exact world the one that does most at both steps, the preset's and half."""
    config = world_config(ratio, spread=0.0)
    game: Any = ROGUE.game(config, 1)
    game.reset(np.ones(1, np.bool_), [seeding.np_random(0)[0]])
    rival = resolve_policy(defender, game.spec("defender"))
    plans = [plan_by_beam(lambda count: game.model(0, count), rival, beam) for beam in BEAMS]
    texts = ["".join("+" if action > 0 else "-" for action in plan.actions) for plan in plans]
    coarse = [_rounded(plan.payoff) for plan in plans]
    fine = [replay(text, defender, ratio, refined=True) for text in texts]
    best = int(np.argmax(np.minimum(coarse, fine)))
    return {"damage": coarse[best], "refined": fine[best], "beams": coarse, "plan": texts[best]}


def replay(plan: str, defender: str, ratio: float, *, refined: bool = False) -> float:
    """The damage of a plan of + and - in the exact world, at the step of the preset or at half of it."""
    config = world_config(ratio, spread=0.0, refined=refined)
    actions = np.array([1.0 if sign == "+" else -1.0 for sign in plan])
    return _rounded(_damages(_Given(ROGUE.game(config, 1).spec("attacker"), actions), defender, config, [0]))


def contest_attacks(defender: str) -> Found:
    """Returns of attacks in preset `learning`, in episodes with an attack: means over those of `SHOWN`.

    The best switching law is chosen on other episodes, those of `CHOSEN`. The beam search plans each episode anew.
    """
    config: RogueConfig = ROGUE.config("learning", {"attack_share": 1.0})
    laws = {each.name: each.reference for each in ATTACKERS if each.name.startswith(("contested", "switching"))}
    chosen = max(laws, key=lambda name: float(_returns(laws[name], defender, config, CHOSEN).mean()))
    planner = BeamPlanner(ROGUE.game(config, 1).spec("attacker"), CONTESTED_WIDTH)
    attacks: dict[str, PolicyReference] = {"law": laws[chosen], "identify": "identify", "beam": planner}
    paid = {name: _returns(attack, defender, config, SHOWN) for name, attack in attacks.items()}
    return {"chosen": chosen, **{name: _rounded(values) for name, values in paid.items()}}


def _answered(candidates: FloatArray, defender: str, ratio: float, worlds: range) -> FloatArray:
    """Damages (P, worlds) of answers (P, 7) after the probe, without a comparison."""
    config, rows = world_config(ratio), np.repeat(np.arange(len(candidates)), len(worlds))
    knowledge = Known((), candidates, np.empty((0, 5)), _probe(ratio), PROBE_S)
    attacker = Identify(ROGUE.game(config, 1).spec("attacker"), knowledge, rows)
    return _damages(attacker, defender, config, list(worlds) * len(candidates)).reshape(len(candidates), -1)


def _trace(defender: str, ratio: float) -> list[float]:
    """What the attacker sees in the mean when its probe is over."""
    config, traces = world_config(ratio), list[FloatArray]()

    def look(game: Game) -> None:
        if game.elapsed[0] == round(PROBE_S / config.control_period_s):
            traces.append(trace_of(Seen(game.fields["attacker"], game.observe("attacker"))))

    attacker = Switching(ROGUE.game(config, 1).spec("attacker"), _probe(ratio))
    players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": defender}
    play_episodes(ROGUE, config, players, list(range(SELECTED, SELECTED + JUDGED)), on_step=look)
    return [round(float(value), 4) for value in traces[0].mean(axis=0)]


def _probe(ratio: float) -> FloatArray:
    """The weights of the probe: those that came with the package for the nearest ratio."""
    rows = {each: weights for (name, each), weights in shipped_weights().items() if name == PROBE}
    return rows[min(rows, key=lambda each: abs(each - ratio))]


class _Given(AnalyticPolicy):
    """One sequence of actions (T,) by the clock."""

    def __init__(self, spec: RoleSpec, actions: FloatArray) -> None:
        super().__init__(spec)
        self.actions = actions

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        left = np.rint(seen["time_left_s"] / self.spec.decision_interval_s).astype(np.int64)
        return self.actions[len(self.actions) - left, np.newaxis], state


def _damages(attacker: PolicyReference, defender: str, config: RogueConfig, worlds: Sequence[int]) -> FloatArray:
    players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": defender}
    return np.asarray(play_episodes(ROGUE, config, players, list(worlds))["damage"])


def _returns(attacker: PolicyReference, defender: str, config: RogueConfig, worlds: Sequence[int]) -> FloatArray:
    players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": defender}
    return np.asarray(play_episodes(ROGUE, config, players, list(worlds))["return"])


def _rounded(damages: FloatArray | float) -> float:
    return round(float(np.mean(damages)), 2)
