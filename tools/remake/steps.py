"""Making the shipped policies anew, each by the command in its card."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

import numpy as np
from safetensors.numpy import load as from_bytes

from cps_agents.errors import CommandError
from cps_agents.zoo.card import SHIPPED, Card, read_card
from cps_agents.zoo.files import START, read_pair, shipped_names
from cps_envs.core.errors import near
from cps_envs.core.types import Array

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
    if words[:3] == ["cps-envs", "self-play", card.problem]:
        policies = tuple(each.name for each in cards if each.command == card.command)
        needs = tuple(each.name for each in cards if each.command != card.command and each.problem == card.problem)
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
    return [[*arguments, "--out", str(home)]]


def do(step: Step, runs: Path, to: Path, jobs: int | None) -> None:
    """Do a step, with the output of its commands.

    Raises:
        CommandError: a command fails.
    """
    for arguments in calls(step, runs, to, jobs):
        if code := _run(arguments):
            raise CommandError(f"`cps-envs {shlex.join(arguments)}` ended with exit code {code}: it continues there")


def compare(shipped: tuple[Card, bytes], to: Path) -> str:
    """A sentence on a policy made anew in the folder `to`: whether it is the shipped one, and how far it is from it.

    `shipped` is the pair that `read_pair` returned before; the folder may be that of the package itself.
    """
    (then, old), (now, new) = shipped, read_pair(to / f"{shipped[0].name}.json")
    if new == old and now.numbers == then.numbers:
        return f"{then.name} is the shipped policy, bit for bit."
    sentences = [f"{then.name} differs from the shipped policy"]
    if now.numbers == then.numbers and (apart := _apart(from_bytes(old), from_bytes(new))):
        same = sum(not difference for difference in apart.values())
        sentences.append(f"{same} of {len(apart)} training seeds are the same, bit for bit")
        sentences.append(f"The largest difference of a number is {max(apart.values()):.2g}")
    score, before = (card.seeds.get(str(card.best), {}).get("validation") for card in (now, then))
    if score is not None and before is not None:
        sentences.append(f"It scores {score:.4g} on validation seeds, {before:.4g} as shipped")
    return ". ".join(sentences) + "."


def _apart(old: Mapping[str, Array], new: Mapping[str, Array]) -> dict[str, float]:
    """For each training seed the largest difference of a weight; nothing where names or shapes are not the same."""
    if {name: array.shape for name, array in old.items()} != {name: array.shape for name, array in new.items()}:
        return {}
    apart: dict[str, float] = {}
    for name, array in old.items():
        seed = name.removeprefix(START).partition("/")[0]
        difference = np.abs(array.astype(float) - new[name].astype(float)).max(initial=0.0)
        apart[seed] = max(apart.get(seed, 0.0), float(difference))
    return apart


def _run(arguments: Sequence[str]) -> int:
    """Run `cps-envs` to its end; it ends with this process."""
    with subprocess.Popen([*PROGRAM, *arguments]) as child:
        try:
            return child.wait()
        except BaseException:
            child.terminate()
            raise
