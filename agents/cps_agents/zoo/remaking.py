"""Making the shipped policies anew, each by the command in its card."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

from cps_agents.errors import CommandError
from cps_agents.zoo.card import MIXTURE, SHIPPED, Card, read_card
from cps_agents.zoo.files import shipped_names
from cps_envs.core.errors import near

PROGRAM = (sys.executable, "-c", "from cps_agents.cli import main; main()")


@dataclass(frozen=True)
class Step:
    """A command that makes policies: one by training, or the mixtures of both roles by self-play."""

    command: str
    policies: tuple[str, ...]
    needs: tuple[str, ...]  # policies that have to be made before
    cpu_s: float  # that it took at least: of all training seeds, up to the networks that were chosen


def steps(names: Sequence[str] = (), folder: Path = SHIPPED) -> list[Step]:
    """What makes the policies of a folder, or those named, in an order in which each finds what it needs.

    A policy needs those that its recipe names. A self-play needs all trained policies of its problem.

    Raises:
        CommandError: there is no such policy, or its card says no command that makes one.
    """
    known = shipped_names(folder)
    for name in names:
        if name not in known:
            raise CommandError(f"no policy {name!r} is shipped. {near(name, known)}")
    cards = [read_card(folder / f"{name}.json") for name in known]
    made = {step.policies: step for step in (_step(card, cards) for card in cards)}
    maker = {name: policies for policies in made for name in policies}
    graph = {key: [maker[name] for name in step.needs if maker[name] != key] for key, step in made.items()}
    ordered = [made[key] for key in TopologicalSorter(graph).static_order()]
    return [step for step in ordered if not names or set(step.policies) & set(names)]


def _step(card: Card, cards: Sequence[Card]) -> Step:
    words = shlex.split(card.command)
    cpu_s = sum(facts.get("cpu_s", 0.0) for facts in card.seeds.values())
    if card.head == MIXTURE and words[:3] == ["cps-envs", "self-play", card.problem]:
        policies = tuple(each.name for each in cards if each.head == MIXTURE and each.problem == card.problem)
        needs = tuple(each.name for each in cards if each.head != MIXTURE and each.problem == card.problem)
        return Step(card.command, policies, needs, cpu_s)
    if words[:3] == ["cps-envs", "train", card.name]:
        told = json.dumps([card.opponent, dict(card.recipe)])
        needs = tuple(each.name for each in cards if re.search(rf"zoo:{each.name}\b(?!-)", told))
        return Step(card.command, (card.name,), needs, cpu_s)
    raise CommandError(f"the card of {card.name} names {card.command!r}, which does not make it: train it again")


def calls(step: Step, runs: Path, to: Path, jobs: int | None) -> list[list[str]]:
    """The arguments of `cps-envs` that do a step; where they have begun before, they go on."""
    arguments = [*shlex.split(step.command)[1:], "--resume"]
    arguments += ["--jobs", str(jobs)] if jobs else []
    if arguments[0] == "train":
        return [[*arguments, "--out", str(runs), "--to", str(to)]]
    home = runs / f"self-play-{arguments[1]}"
    return [[*arguments, "--out", str(home)], ["zoo", "mix", str(home / "self-play.json"), "--to", str(to)]]


def remake(step: Step, runs: Path, to: Path, jobs: int | None) -> None:
    """Do a step, with the output of its commands.

    Raises:
        CommandError: a command fails.
    """
    for arguments in calls(step, runs, to, jobs):
        if code := _run(arguments):
            raise CommandError(f"`cps-envs {shlex.join(arguments)}` ended with exit code {code}: it continues there")


def compare(shipped: Card, to: Path) -> str:
    """A sentence on a policy that was made anew in the folder `to`: whether it is the shipped one, bit for bit."""
    made = read_card(to / f"{shipped.name}.json")
    if made.weights == shipped.weights:
        return f"{shipped.name} is the shipped policy, bit for bit."
    now, then = (card.seeds.get(str(card.best), {}).get("validation") for card in (made, shipped))
    if now is None or then is None:
        return f"{shipped.name} differs from the shipped policy."
    return f"{shipped.name} differs from the shipped policy: {now:.4g} on validation seeds, {then:.4g} as shipped."


def _run(arguments: Sequence[str]) -> int:
    """Run `cps-envs` to its end; it ends with this process."""
    with subprocess.Popen([*PROGRAM, *arguments]) as child:
        try:
            return child.wait()
        except BaseException:
            child.terminate()
            raise
