"""The pages of the environments: one for each role of a problem, and one for what its roles share."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator

from cps_agents.catalogue import PolicyEntry, pettingzoo_ids, policies
from cps_agents.scoring.tracks import tracks
from cps_agents.sheet import Sheet
from cps_envs import PROBLEMS
from cps_envs.core.declare.config import parameter_table
from cps_envs.core.declare.training import NATIVE, Training
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.registration import class_name
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.types import ROLES, Array, Role
from tools.pages.diagram import LOOPS, diagram

MARK = "<!-- Written by `make pages` from the docstrings of environments and policies; do not edit. -->\n"
DOCS = Path(__file__).parents[2] / "docs"
ENDS = "## References"  # what we add goes before it
LONGEST = 4  # entries of an action that are written out where they are equal


def pages() -> dict[str, str]:
    """The text of each page by its file name."""
    found = {"environments/index.md": index()}
    for problem in PROBLEMS.values():
        found[f"environments/{problem.name}.md"] = "\n".join(shared(problem)).rstrip() + "\n"
        found |= {_file(problem, role): "\n".join(page(problem, role)).rstrip() + "\n" for role in ROLES}
        if problem.name in LOOPS:
            found[f"images/{problem.name}-loop.svg"] = diagram(problem.name)
    return found


def index() -> str:
    """The page that lists all games and their environments."""
    lines = [f"# Games\n\n{MARK}"]
    lines.append(
        "Choose a game and a role. Each game has a page of its own: who knows what, how to attack and defend, and what "
        "the baselines reach. Each role has a page with its actions, observations and rewards.\n"
    )
    for problem in PROBLEMS.values():
        title = (DOCS / f"{problem.name}.md").read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")
        roles = [f"[`{problem.env_id(role)}`]({class_name(problem, role)}.md)" for role in ROLES]
        lines.append(f"## [{title}](../{problem.name}.md)\n\n![An episode](../images/{problem.name}.gif)\n")
        lines.append(f"{problem.summary}\n\n{', '.join(roles)}, [teams, presets, arguments]({problem.name}.md)\n")
    lines += ["```{toctree}\n:hidden:\n", *(f"../{name}" for name in PROBLEMS), "```"]
    return "\n".join(lines) + "\n"


def page(problem: Problem, role: Role) -> Iterator[str]:
    """The parts of a role's page: its docstring with pictures; what both roles share is on the problem's page."""
    name = class_name(problem, role)
    made: Any = load_env_creator(str(gymnasium.spec(problem.env_id(role)).entry_point))
    text = _without_arguments(inspect.getdoc(made) or "", problem)
    before, _, after = text.partition("\n## Threat Model\n")
    head, _, closing = after.partition(f"\n{ENDS}\n")
    yield f"# {name}\n\n{MARK}"
    yield f"![An episode of {problem.name}](../images/{problem.name}.gif)\n"
    yield before
    yield f"![What each side touches](../images/{problem.name}-loop.svg)\n"
    yield "The [glossary](../glossary.md) explains words and symbols.\n"
    yield f"## Threat Model\n\n{head}"
    yield from _adapters(problem, role)
    page, named = f"{problem.name}.md", f"policies-of-the-{role}"
    yield (
        f"## Presets and Baselines\n\n[The game](../{page}) says which there are and what they reach. All in tables: "
        f"[presets]({page}#presets), [policies of the {role}]({page}#{named}).\n"
    )
    yield f"## Code to Start\n\n```python\n{_snippet(problem, role)}\n```\n"
    yield f"{ENDS}\n\n{closing}"


def _without_arguments(text: str, problem: Problem) -> str:
    link = f"[the list with units, bounds and sources]({problem.name}.md#arguments)"
    table = parameter_table(problem.presets[problem.usual_preset])
    return text.replace(f":\n\n{table}", f", see {link}.").replace(table, f"See {link}.")


def shared(problem: Problem) -> Iterator[str]:
    """The parts of a problem's page: PettingZoo's interfaces, presets, policies of both roles, arguments."""
    links = " and ".join(f"[{class_name(problem, role)}]({class_name(problem, role)}.md)" for role in ROLES)
    yield f"# {problem.name}: both roles, and teams\n\n{MARK}\n{problem.summary} For one role alone see {links}."
    yield "The [glossary](../glossary.md) explains words and symbols.\n"
    for form, function in pettingzoo_ids(problem).items():
        if form != "id":
            module, _, attribute = function.rpartition(".")
            yield f"## `{function}`\n\n{inspect.getdoc(getattr(import_module(module), attribute)) or ''}\n"
    yield f"## Presets\n\n{_presets(problem)}\n"
    for role in ROLES:
        yield f"## Policies of the {role}\n\n{_policies(policies(problem, role))}\n"
    usual = problem.usual_preset
    yield f"## Arguments\n\nThe values are those of preset `{usual}`.\n\n{parameter_table(problem.presets[usual])}\n"


def _file(problem: Problem, role: Role) -> str:
    return f"environments/{class_name(problem, role)}.md"


def _snippet(problem: Problem, role: Role) -> str:
    made = f'"{problem.namespace}:{problem.env_id(role)}"'
    return (
        "import gymnasium\n\n"
        f"env = gymnasium.make({made})  # for learners\n"
        "observation, info = env.reset(seed=0)\n"
        "observation, reward, terminated, truncated, info = env.step(env.action_space.sample())\n\n"
        f"envs = gymnasium.make_vec({made}, num_envs=64)\n"
        f'native = gymnasium.make({made}, interface="native")  # the game\'s own observations and actions'
    )


def _adapters(problem: Problem, role: Role) -> Iterator[str]:
    """What learners can play the role through, and the settings with which an ordinary one learns."""
    game, training = problem.game(problem.presets["learning"], 1), problem.training.get(role, Training())
    spec = game.spec(role)
    if not spec.adapters:
        return
    interval_s = spec.decision_interval_s * training.frame_skip
    decisions = -(-game.horizon // (game.decision_interval[role] * training.frame_skip))
    yield "## For Learners\n"
    yield (
        f"**An episode has {decisions} decision{'s' * (decisions > 1)}, each for {interval_s:g} s.** These lines "
        "train PPO of stable-baselines3 with settings that work; [Learning](../learning.md) explains them.\n"
    )
    yield f'`info["cost"]` is the increase of `{problem.cost}`, with a limit of {problem.cost_limit:g} an episode.\n'
    yield (
        "```python\nfrom stable_baselines3 import PPO\n\nfrom cps_agents.sb3 import make\n\n"
        f'envs = make("{class_name(problem, role)}")\n'
        'model = PPO("MlpPolicy", envs, seed=0, verbose=1, **envs.settings)\n'
        f"model.learn({training.total_timesteps:_})  # a few CPU minutes\n"
        'model.save("model.zip")\n```\n'
    )
    for name, track in tracks().items():
        if (track.problem, track.role) == (problem.name, role):
            yield f"Then [the challenge](../challenge.md) ranks it: `cps-envs --trust score {name} sb3:model.zip`.\n"
    if role in problem.training:
        yield f"{_settings(training)}\n"
    shown: dict[str, list[str]] = {}  # adapters, and the lines of the tables of what they see
    begins = () if training.adapter in (NATIVE, *spec.adapters) else (training.adapter,)  # as a controller plays
    for name in (*spec.adapters, *begins):
        adapter = adapter_of(spec, name)
        first, last = adapter.agents[0], adapter.agents[-1]
        who = (
            "One agent acts"
            if len(adapter.agents) == 1
            else f"{len(adapter.agents)} agents, `{first}` to `{last}`, act"
        )
        meaning = (inspect.getdoc(type(adapter)) or "").partition("\n\nRaises:")[0]
        yield f"### Adapter `{name}`\n\n{meaning}\n"
        yield f"{who} in `{adapter.action_space}`. The neutral action is {_action(adapter.neutral_action)}.\n"
        table = adapter.fields.table().splitlines()
        yield _seen(table, shown)
        shown[name] = table


def _seen(table: list[str], shown: Mapping[str, list[str]]) -> str:
    """The table of what an adapter sees, without what an adapter before it sees, too."""
    for name, before in shown.items():
        if table == before:
            return f"It sees the same as `{name}`.\n"
        if table[: len(before)] == before:
            more = "\n".join([*table[:2], *table[len(before) :]])
            return f"It sees what `{name}` does, and\n\n{more}\n"
    return "\n".join(table) + "\n"


def _action(action: Array) -> str:
    """An action; many equal entries are written once."""
    entries = action.ravel().tolist()
    many = len(entries) > LONGEST and len(set(entries)) == 1
    return f"{len(entries)} times `{entries[0]}`" if many else f"`{action.tolist()}`"


def _settings(training: Training) -> str:
    """The training settings that differ from the usual ones, as a table."""
    usual = Training(total_timesteps=training.total_timesteps)  # stands above
    found = [entry.name for entry in fields(training) if getattr(training, entry.name) != getattr(usual, entry.name)]
    rows = [(f"`{name}`", f"`{getattr(training, name)}`") for name in found]
    return "\n".join(Sheet("", ("Setting", "Value"), rows).markdown())


def _presets(problem: Problem) -> str:
    """How each preset differs from `paper`."""
    paper = vars(problem.presets["paper"])
    lines = ["| Preset | Attacker by default | Defender by default | Differs from `paper` in |", "|---|---|---|---|"]
    for name, config in problem.presets.items():
        changed = [f"`{field} = {value!r}`" for field, value in vars(config).items() if value != paper[field]]
        players = problem.opponents[name]
        differences = ", ".join(changed) or "-"
        lines.append(f"| `{name}` | `{players['attacker']}` | `{players['defender']}` | {differences} |")
    return "\n".join(lines)


def _policies(entries: list[PolicyEntry]) -> str:
    rows = [
        (
            f"`{each.name}`",
            (each.summary or f"needs {each.missing}") + (each.plays_in and f" (plays {each.plays_in}, not `learning`)"),
            ", ".join(each.privileged) or "-",
        )
        for each in entries
    ]
    return "\n".join(Sheet("", ("Name", "What it does", "Knows beyond what it observes"), rows).markdown())
