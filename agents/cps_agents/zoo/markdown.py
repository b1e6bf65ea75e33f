"""A trained policy's card as Markdown, with the header that model hubs read."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cps_agents.zoo.card import Card
from cps_envs.core.policies.adapter import advised_by
from cps_envs.core.policies.lookup import load, policy_entry
from cps_envs.core.types import ROLES

ELSEWHERE = (
    "stable-baselines3",
    "sb3-contrib",
    "pymoo",
    "pettingzoo",
    "osqp",
)  # packages that our own PPO does not use
OF_SEARCH = {"family", "population", "search_deviation", "search_steps", "scenes"}
OF_OTHERS = {"buffer_size", "exploration_share", "learning_starts", "updates_per_step", "memory_units"}
CITATION = "A. Al-Hashimi, *A Study of Potential Security and Safety Vulnerabilities in Cyber-Physical Systems*, 2020"


def to_markdown(card: Card) -> str:
    """What it does, how to play it, how it was trained, what was measured, and its limits."""
    parts = (_header(card), _use(card), _training(card), _results(card), _limits(card), _knobs(card))
    return "\n\n".join(part for part in parts if part) + "\n"


def _header(card: Card) -> str:
    front = {
        "library_name": "cps-envs",
        "license": "mit",
        "pipeline_tag": "reinforcement-learning",
        "tags": ["reinforcement-learning", "cps-envs", "cyber-physical-systems", card.problem, card.role],
        "model_name": card.name,
        "model-index": [{"name": card.name, "results": [_result(card)]}],
    }
    lines = [f"{name}: {json.dumps(value) if isinstance(value, list) else value}" for name, value in front.items()]
    summary = (
        f"The {card.role} of `{card.problem}-v{card.version}` in [cps_envs](https://pypi.org/project/cps-envs/), "
        f"trained by {card.algorithm} against `{card.opponent}`. One policy, {len(card.seeds)} training seeds; seed "
        f"{card.best} did best on validation episodes and plays unless another is named."
    )
    return "\n".join(["---", *lines, "---", "", f"# {card.name}", "", summary])


def _result(card: Card) -> dict[str, Any]:
    """The validation of the seed that plays, as hubs list results."""
    game = f"{card.problem}-v{card.version}, preset {card.preset}, {card.role}"
    value = card.seeds[str(card.best)].get("validation")
    return {
        "task": {"type": "reinforcement-learning", "name": "reinforcement-learning"},
        "dataset": {"type": f"{card.problem}-v{card.version}", "name": game},
        "metrics": [{"type": "mean_reward", "name": "mean return on validation seeds", "value": value}],
    }


def _use(card: Card) -> str:
    settings = " ".join(f"--set '{name}={json.dumps(value)}'" for name, value in card.overrides.items())
    rival = "defender" if card.role == "attacker" else "attacker"
    command = f"cps-envs play {card.problem} --preset {card.preset} {settings}".rstrip()
    return "\n".join(
        [
            "## Play",
            "",
            "```console",
            '$ pip install "cps-envs[cli,baselines]"',
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
    versions = ", ".join(f"{name} {version}" for name, version in card.versions.items() if name not in ELSEWHERE)
    began = _began(card)
    return "\n".join(
        ["## Training", "", f"`{card.command}`", "", *began, *_table(columns, rows), "", f"With {versions}."]
    )


def _began(card: Card) -> list[str]:
    """A sentence that learning began as a controller plays, if it did."""
    name, role = str(card.wiring.get("adapter", "")), next(role for role in ROLES if role == card.role)
    entry = policy_entry(card.problem, role, name) if name else None
    if entry is None or advised_by(load(entry)) is None:
        return []
    told = (
        f"It plays through the adapter `{name}`: its neutral action is what the controller `{name}` does, and learning "
        "began there. So it does not show that reward alone finds such a controller."
    )
    return [told, ""]


def _results(card: Card) -> str:
    """What its making measured, with its interval, where its card says so."""
    columns = ("measured", "row", "metric", "mean", "95 % interval", "episodes")
    rows = [
        (block, row, f"`{found['metric']}`", f"{found['mean']:.4g}", _interval(found), str(found.get("episodes", "")))
        for block, examined in card.evaluation.items()
        for row, found in examined.items()
        if isinstance(found, Mapping) and "mean" in found
    ]
    if not rows:
        return ""
    return "\n".join(["## Results", "", *_table(columns, rows)])


def _interval(found: Mapping[str, Any]) -> str:
    low, high = found.get("low"), found.get("high")
    return "" if low is None or high is None else f"{low:.4g} to {high:.4g}"


def _limits(card: Card) -> str:
    return "\n".join(
        [
            "## Limits",
            "",
            f"It plays only in the configuration that it was trained in, preset `{card.preset}`. Measure it against "
            "opponents that it has not met with `cps-envs evaluate` before you rely on it. It is a research artefact "
            "about simulated systems; do not connect it to a real one.",
            "",
            f"The problem is that of {CITATION}.",
        ]
    )


def _knobs(card: Card) -> str:
    knobs = json.dumps({name: value for name, value in card.recipe.items() if _turned(card, name)}, sort_keys=True)
    return f"## Knobs\n\nThose that are on; `cps-envs zoo show {card.name} --json` prints all.\n\n```json\n{knobs}\n```"


def _turned(card: Card, knob: str) -> bool:
    """Whether a knob is on, and of the card's algorithm."""
    recipe, search = card.recipe, card.algorithm == "cma-es"
    if not recipe[knob] or knob in OF_OTHERS or (knob in OF_SEARCH and not search):
        return False
    if knob == "bias_learning_rate":
        return bool(recipe.get("episode_noise"))
    return not knob.startswith("teacher_") or bool(recipe.get("teacher"))


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    cells = [columns, ["---"] * len(columns), *rows]
    return ["| " + " | ".join(text.replace("|", "\\|") for text in row) + " |" for row in cells]
