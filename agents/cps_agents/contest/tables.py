"""A contest's document as tables, for terminal and documentation: `docs/contest.json`, `docs/contest.md`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.contest.contest import find_contests
from cps_agents.contest.document import Document, remarks
from cps_agents.contest.rules import NEUTRAL, NOT_WON, TOLD
from cps_agents.errors import CommandError
from cps_agents.files import write_figure, write_json, write_text
from cps_agents.heatmap import draw_matrix
from cps_agents.table import Table
from cps_envs.core.documents import read_entry, read_text
from cps_envs.core.types import ROLES, SIGN, Role

KINDS = {"policy": "", "informed": " (told)", "constant": "", "searched": " (searched)"}
NONE = "-"
# of results that were kept before strategies were valued on episodes that had not chosen them
OLD_VALUE = "It was computed on the episodes that chose the strategies: its interval is too short."


def tables(found: Document) -> Iterator[Table]:
    """All tables of a variant."""
    where, unit = f"{found['problem']}, {found['title']}", found["unit"]
    yield Table(
        f"{where}: defenders. Attacker's pay in {unit}, lower is better",
        ("defender", "mean", "no attack", "worst known attacker", "best response"),
        [_defender(row) for row in sorted(found["defenders"], key=lambda row: row["score"]["mean"])],
    )
    yield Table(
        f"{where}: attackers. Pay in {unit}, higher is better",
        ("attacker", "mean", "no defence", "least, against"),
        [_attacker(row) for row in sorted(found["attackers"], key=lambda row: -row["score"]["mean"])],
    )
    yield Table(
        f"{where}: what means hide, over all attackers and the best response",
        ("defender", f"excess over told, {unit}", *(column["title"] for column in found["columns"])),
        [_hidden(row, found["columns"]) for row in found["defenders"]],
    )
    if found.get("constraint"):
        yield _constrained(where, found["constraint"])
    if found["rules"]:
        yield Table(
            f"{where}: is it a contest?",
            ("rule", "role", "of whom", f"by how much, {unit}", "more than", "holds"),
            [_rule(rule) for rule in found["rules"]],
            left=3,
        )


def _name(row: Mapping[str, Any]) -> str:
    name = str(row["name"])
    return name if name == TOLD else f"{name}{KINDS[row['kind']]}"


def _defender(row: Mapping[str, Any]) -> list[str]:
    response = row.get("response")
    return [
        _name(row),
        interval(row["score"]),
        NONE if row["without"] is None else _number(row["without"]),
        f"{_number(row['worst']['mean'])} {row['worst']['by']}",
        f"{interval(response)} {response['by']}" if response else NONE,
    ]


def _hidden(row: Mapping[str, Any], columns: Sequence[Mapping[str, Any]]) -> list[str]:
    texts = [column["form"].format(value) for column, value in zip(columns, row["columns"], strict=True)]
    return [_name(row), interval(row["excess"]) if "excess" in row else NONE, *texts]


def _constrained(where: str, rule: Mapping[str, Any]) -> Table:
    """The defenders whose cost is surely not above the reference's first, each group from the least harm on."""
    order = ("yes", "open", "no")
    rows = sorted(rule["rows"], key=lambda row: (order.index(_within(row["cost_beyond"])), row["harm"]["mean"]))
    beyond = f"beyond `{rule['reference']}`"
    columns = ("defender", rule["harm"]["title"], beyond, rule["cost"]["title"], beyond, "within")
    shown = ("harm", "harm_beyond", "cost", "cost_beyond")
    texts = [[row["name"], *(interval(row[name]) for name in shown), _within(row["cost_beyond"])] for row in rows]
    return Table(f"{where}: at no more cost than `{rule['reference']}`", columns, texts)


def _within(beyond: Mapping[str, Any]) -> str:
    """Whether a cost is at most that of the reference: open where the interval of the difference contains zero."""
    low, high = (beyond["mean"] if beyond[end] is None else beyond[end] for end in ("low", "high"))
    return "yes" if high <= 0 else "no" if low > 0 else "open"


def _attacker(row: Mapping[str, Any]) -> list[str]:
    if "against" not in row:
        return [_name(row), interval(row["score"]), NONE, NONE]
    return [
        _name(row),
        interval(row["score"]),
        NONE if row["without"] is None else _number(row["without"]),
        f"{_number(row['worst']['mean'])} {row['worst']['by']}",
    ]


def _rule(rule: Mapping[str, Any]) -> list[str]:
    high, low = rule["better"], rule["worse"]
    return [
        rule["rule"],
        rule["role"],
        f"{low} against {high}" if rule["rule"] == NOT_WON else f"{high} over {low}",
        interval(rule["lead"]),
        _number(rule["margin"]),
        "yes" if rule["holds"] else "NO",
    ]


def _number(value: float) -> str:
    return f"{value:.2f}" if abs(value) < 100 else f"{value:.0f}"


def interval(found: Mapping[str, Any]) -> str:
    """A mean with its interval."""
    ends = "" if found["low"] is None else f" [{_number(found['low'])}, {_number(found['high'])}]"
    return f"{_number(found['mean'])}{ends}"


def draw(found: Document) -> Any:
    """Every meeting of the policies as a matplotlib figure."""
    attackers = [row for row in found["attackers"] if row["kind"] == "policy"]
    defenders = [row["name"] for row in found["defenders"] if row["kind"] in ("policy", "informed")]
    means = np.array([[row["paid"][name] for name in defenders] for row in attackers], np.float64)
    texts = [[_number(value) for value in row] for row in means]
    title = f"{found['problem']}, {found['title']}: attacker's pay, {found['unit']}, {found['episodes']} episodes"
    limits = (min(float(means.min()), 0.0), max(float(means.max()), 1e-9))
    names = [row["name"] for row in attackers]
    return draw_matrix(means, texts, names, defenders, title=title, axis="defender", limits=limits)


def summary(every: Sequence[Document]) -> Table:
    """One row for each role of the judged variants."""
    rows = [_role(found, role) for found in every if found["rules"] for role in ROLES]
    columns = ("problem, role", "nothing", "best constant", "best policy", "told", "least exploited policy")
    return Table("What the attacker is paid, mean over the policies of the other side", columns, rows)


def _role(found: Document, role: Role) -> list[str]:
    rows, sign = found[f"{role}s"], SIGN[role]
    neutral = next(row for row in rows if row["name"] == NEUTRAL)
    texts = []
    for kind in ("constant", "policy", "informed"):
        group = [row for row in rows if row["kind"] == kind]
        best = max(group, key=lambda row: sign * row["score"]["mean"], default=None)
        name = "" if best is None or kind == "constant" else f" {best['name']}"
        texts.append(NONE if best is None else f"{interval(best['score'])}{name}")
    responses = [(row["response"], row["name"]) for row in rows if row["kind"] == "policy" and "response" in row]
    worst = min(responses, key=lambda pair: float(pair[0]["mean"]), default=None)
    texts.append(NONE if worst is None else f"{interval(worst[0])} {worst[1]}")
    return [f"{found['problem']}, {role}", interval(neutral["score"]), *texts]


def markdown(found: Document) -> str:
    """A section of the documentation."""
    effort = found["effort"]
    lines = [f"## {found['problem']}: {found['title']}", ""]
    changed = f" with {found['overrides']}" if found["overrides"] else ""
    made = f"Preset `{found['preset']}`{changed}, {found['episodes']} evaluation episodes of each meeting"
    if found["searches"]:
        made += f", {effort['budget_s']:.0f} CPU seconds of search against each defender"
    lines += [f"{made}. `{found['command']}`.", ""]
    if found["searches"]:
        lines += [f"![Pay of every meeting](images/contest-{found['problem']}.png)", ""]
    for table in tables(found):
        lines += [*as_markdown(table), ""]
    lines += list(_notes(found))
    return "\n".join(lines).rstrip("\n") + "\n"


def as_markdown(table: Table) -> list[str]:
    """The lines of a table with its title."""
    return [f"**{table.title}**", "", *table.markdown()]


def value_line(found: Document) -> str:
    """The value of the game of all policies and searched attacks, and who plays it."""
    game, sides = found["game"], []
    for role in ROLES:
        shares = (f"{name} {share:.0%}" for name, share in found["game"][role].items())
        sides.append(f"the {role} plays {', '.join(shares)}")
    value, caution = interval(game["value"]), "" if "value_of_means" in game else f" {OLD_VALUE}"
    return (
        f"Value of the game of all policies and searched attacks: {value} {found['unit']}; {'; '.join(sides)}.{caution}"
    )


def _notes(found: Document) -> Iterator[str]:
    """What a reader of the tables has to know; a problem's other variants share the notes of the judged one."""
    if not found["rules"]:
        return
    yield f"- {value_line(found)}"
    for note in found["notes"]:
        yield f"- {note}"
    for role, reasons in found["left_out"].items():
        for name, reason in reasons.items():
            yield f"- Left out: {role} `{name}`: {reason}"
    for role in ROLES:
        for row in found[f"{role}s"]:
            if row["kind"] in ("constant", "searched"):
                yield f"- {row['name']}, {role}: `{row['reference']}`"
    responses = {row["name"]: row["response"] for row in found["defenders"] if row.get("response")}
    for name, response in responses.items():
        yield f"- Best response to {name}: `{response['reference']}`"


END = "<!-- the tables below are written by `cps-envs contest --publish` -->"


def publish(new: Sequence[Document], root: Path) -> list[Path]:
    """Renew both files below `root` for the variants of the documents; other declared ones stay. Returns their paths.

    Raises:
        CommandError: no repository of this package.
        DamagedFileError: the kept documents are damaged.
    """
    page, data = root / "docs" / "contest.md", root / "docs" / "contest.json"
    text = read_text(page) if page.is_file() else ""
    if END not in text:
        raise CommandError(f"{page} has no line {END}: publish from the repository's folder")
    before = _published(data) if data.is_file() else []
    known = {_key(found): found for found in (*before, *new)}
    contests = find_contests([])
    declared = [((each.problem, variant.name), each) for each in contests for variant in each.variants]
    every = [known[key] | remarks(contest) for key, contest in declared if key in known]
    pictures = [_picture(root, found) for found in new if found["searches"]]
    write_json(data, every)
    first = "\n".join(["## All roles", "", *as_markdown(summary(every))]) + "\n"
    write_text(page, "\n".join([text.partition(END)[0] + END, "", first, *map(markdown, every)]))
    return [page, data, *pictures]


def _published(path: Path) -> list[Document]:
    """What a file of contests holds, by problem and variant."""
    rows = read_entry(path, "file of contests", "Take it from the repository again.").rows()
    for row in rows:
        row["problem"].text(), row["variant"].text()
    return [row.plain() for row in rows]


def _key(found: Document) -> tuple[str, str]:
    return found["problem"], found["variant"]


def _picture(root: Path, found: Document) -> Path:
    """The heat map of a judged variant, which its section shows."""
    path = root / "docs" / "images" / f"contest-{found['problem']}.png"
    write_figure(path, draw(found))
    return path
