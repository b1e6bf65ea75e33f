"""A trained policy's card as Markdown, with the header that model hubs read."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cps_agents.zoo.card import Card
from cps_agents.zoo.rivals import better_rival

CITATION = "A. Al-Hashimi, *A Study of Potential Security and Safety Vulnerabilities in Cyber-Physical Systems*, 2020"


def to_markdown(card: Card, rivals: Sequence[Card] = ()) -> str:
    """What it does, how to play it, how it was trained, what it reached and on which episodes, what it knows not.

    `rivals` are the policies of which one may do better.
    """
    results = f"{_results(card)}\n\n{better_rival(card, rivals)}".rstrip()
    parts = (_header(card), _use(card), _training(card), results, _judged(card), _limits(card), _knobs(card))
    return "\n\n".join(part for part in parts if part) + "\n"


def _header(card: Card) -> str:
    front = {
        "library_name": "cps-envs",
        "license": "mit",
        "tags": ["reinforcement-learning", "cps-envs", "cyber-physical-systems", card.problem, card.role],
        "model_name": card.name,
    }
    lines = [f"{name}: {json.dumps(value) if isinstance(value, list) else value}" for name, value in front.items()]
    summary = (
        f"The {card.role} of `{card.problem}-v{card.version}` in [cps_envs](https://pypi.org/project/cps-envs/), "
        f"trained by {card.algorithm} against `{card.opponent}`. One policy, {len(card.seeds)} training seeds; seed "
        f"{card.best} did best on validation episodes and plays unless another is named."
    )
    return "\n".join(["---", *lines, "---", "", f"# {card.name}", "", summary])


def _use(card: Card) -> str:
    settings = " ".join(f"--set '{name}={json.dumps(value)}'" for name, value in card.overrides.items())
    rival = "defender" if card.role == "attacker" else "attacker"
    command = f"cps-envs play {card.problem} --preset {card.preset} {settings}".rstrip()
    return "\n".join(
        [
            "## Play",
            "",
            "```console",
            '$ pip install "cps-envs[baselines]"',
            f"$ {command} --{card.role} zoo:{card.name}",
            f"$ {command} --{card.role} 'zoo:{card.name}?seed={card.best}' --{rival} none",
            "```",
            "",
            f"Its weights are safetensors, SHA-256 `{card.weights}`. Loading them runs no code.",
        ]
    )


def _training(card: Card) -> str:
    columns = ("training seed", "steps", "CPU s", "validation")
    shown = {"steps": "{:,}", "cpu_s": "{:.0f}", "validation": "{:.4g}"}
    rows = [
        (seed, *(form.format(facts[name]) if name in facts else "" for name, form in shown.items()))
        for seed, facts in card.seeds.items()
    ]
    versions = ", ".join(f"{name} {version}" for name, version in card.versions.items())
    return "\n".join(["## Training", "", f"`{card.command}`", "", *_table(columns, rows), "", f"With {versions}."])


def _results(card: Card) -> str:
    """Every row of every examination, with its interval."""
    columns = ("examination", "row", "metric", "mean", "95 % interval", "episodes")
    rows = [
        (block, row, f"`{found['metric']}`", f"{found['mean']:.4g}", _interval(found), str(found.get("episodes", "")))
        for block, examined in card.evaluation.items()
        for row, found in examined.items()
        if isinstance(found, Mapping) and "mean" in found
    ]
    if not rows:
        return "## Results\n\nIt has not been examined yet: `cps-envs benchmark --suite learned` does that."
    text = "Over all training seeds, on episodes that neither training nor the choice among networks has seen."
    return "\n".join(["## Results", "", text, "", *_table(columns, rows)])


def _judged(card: Card) -> str:
    title = "Worst case found" if card.role == "defender" else "Share of the best attack known"
    return f"## {title}\n\n{judgement_sentence(card)}"


def judgement_sentence(card: Card) -> str:
    """What the worst attack found costs a defender; how much of the best attack known an attacker reaches."""
    if card.role == "attacker":
        return _share_sentence(card)
    found = card.exploitability
    if not found:
        return f"It has not been judged by the worst attack yet: `cps-envs zoo judge {card.name}` does that."
    pay = found["pay"]
    return (
        f"The worst attack found, `{found['attack']}`, costs it {pay['mean']:.4g} ({_interval(pay)}) {found['unit']}, "
        f"the mean over {pay['episodes']} evaluation episodes. {found['attacks']} known attacks played, and searches "
        f"of {found['budget_s']:g} CPU s against this policy. A longer search may find a worse one."
    )


def _share_sentence(card: Card) -> str:
    found = card.share
    if not found:
        return f"It has not been compared with the best attack known yet: `cps-envs zoo judge {card.name}` does that."
    pay, best = found["pay"], found["best_pay"]
    rivals = ", ".join(f"`{attack}` against `{opponent}`" for opponent, attack in found["best"].items())
    return (
        f"It reaches {share_text(found)} of what the best other attack known is paid: {pay['mean']:.4g} "
        f"({_interval(pay)}) beside {best['mean']:.4g} ({_interval(best)}) {found['unit']}, the mean over "
        f"{pay['episodes']} evaluation episodes. The best is {rivals}. {found['attacks']} known attacks played, and "
        f"searches of {found['budget_s']:g} CPU s. A longer search may find a better one."
    )


def share_text(found: Mapping[str, Any]) -> str:
    """A share of the best attack's pay with its interval, in percent."""
    share = found["share"]
    return f"{share['mean']:.1%} ({share['low']:.1%} to {share['high']:.1%})"


def _interval(found: Mapping[str, Any]) -> str:
    low, high = found.get("low"), found.get("high")
    return "" if low is None or high is None else f"{low:.4g} to {high:.4g}"


def _limits(card: Card) -> str:
    return "\n".join(
        [
            "## Limits",
            "",
            f"It fits the configuration that it was trained in, preset `{card.preset}`. What it does against opponents "
            "that it has not met is a matter for an examination, not for trust. It is a research artefact about "
            "simulated systems; do not connect it to a real one.",
            "",
            f"The problem is that of {CITATION}.",
        ]
    )


def _knobs(card: Card) -> str:
    knobs = json.dumps(dict(card.recipe), indent=2, sort_keys=True)
    return f"## Every knob\n\n```json\n{knobs}\n```"


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    cells = [columns, ["---"] * len(columns), *rows]
    return ["| " + " | ".join(text.replace("|", "\\|") for text in row) + " |" for row in cells]
