"""What tables show of a document, as text; the same for terminal, Markdown and README."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cps_agents.results.judging import MISSING, REACHED, VERDICTS, count_verdicts, worst

Block = Mapping[str, Any]  # of a document
BETWEEN = " to "
MARK = " (one seed)"


def heading(block: Block) -> str:
    """What the numbers of a block are."""
    measured = f"{block['metric']} / {block['per']}" if block["per"] else block["metric"]
    unit = f" in {block['unit']}" if block["unit"] else ""
    shown = f"; beside it {', '.join(block['shown'])}" if block["shown"] else ""
    better = "more" if block["role"] == "attacker" else "less"
    return f"{measured}{unit}, mean (95 % interval){shown}; the {block['role']} wants {better}"


def score_text(block: Block, row: Mapping[str, Any], name: str, *, interval: bool = True, beside: bool = True) -> str:
    """What a contestant reached in a row: mean, interval, and means of what is shown beside."""
    score = row["scores"].get(name)
    if score is None:
        return MISSING
    text = number(block, row, score["mean"])
    if interval and score["low"] is not None:
        text += f" ({number(block, row, score['low'])}{BETWEEN}{number(block, row, score['high'])})"
    shown = [f"{value:.3g}" for value in score["shown"].values()] if beside else []
    return " / ".join([text, *shown])


def number(block: Block, row: Mapping[str, Any], value: float) -> str:
    """A value of a row's metric."""
    return block["form"].format(value) if row["metric"] == block["metric"] else f"{value:.2f}"


def bar_lines(row: Mapping[str, Any], name: str) -> Iterator[str]:
    """Each bar of a learned policy: what was asked, the difference or the value with its interval.

    Of several baselines that one bar asks to beat, the one that is hardest to beat.
    """
    mine = [each for each in row["judgements"] if each["policy"] == name]
    for place in dict.fromkeys(each["place"] for each in mine):
        group = [each for each in mine if each["place"] == place]
        each = max(group, key=lambda found: (VERDICTS.index(found["verdict"]), -found["margin"]))
        limit = each["limit"] if len(group) == 1 else f"all {len(group)}, hardest {each['limit']}"
        sign = "+" if each["against"] else ""
        ends = "" if each["low"] is None else f" ({each['low']:{sign}.3g}{BETWEEN}{each['high']:{sign}.3g})"
        mark = "" if each["verdict"] == REACHED else f", {each['verdict']}"
        yield f"{each['relation']} {limit}: {each['mean']:{sign}.3g}{ends}{mark}"


def best_baseline(block: Block, row: Mapping[str, Any], name: str) -> str:
    """The baseline that a learned policy finds hardest to beat: its mean, and the paired difference to it."""
    titles = {each["name"]: each["title"] for each in block["baselines"] if not each["optimum"]}
    sign = 1.0 if block["role"] == "attacker" else -1.0
    found = {other: each for other, each in row["differences"].get(name, {}).items() if other in titles}
    if found:
        other = min(found, key=lambda each: sign * found[each]["mean"])
        low, high = found[other]["low"], found[other]["high"]
        ends = "" if low is None else f" ({signed(block, row, low)}{BETWEEN}{signed(block, row, high)})"
        difference = f"; {signed(block, row, found[other]['mean'])}{ends}"
        episodes = found[other]["episodes"]
        few = f" in {episodes} common episodes" if episodes < row["scores"][name]["episodes"] else ""
        return f"{titles[other]} {number(block, row, row['scores'][other]['mean'])}{difference}{few}"
    known = {other: row["scores"][other]["mean"] for other in titles if other in row["scores"]}
    best = max(known, key=lambda each: sign * known[each], default="")
    return f"{titles[best]} {number(block, row, known[best])}" if best else ""


def signed(block: Block, row: Mapping[str, Any], value: float) -> str:
    """A difference of a row's metric, with its sign."""
    return f"{'+' if value > 0 else ''}{number(block, row, value)}"


def judged_against(block: Block) -> Iterator[str]:
    """Whom each learned policy was judged against, in which rows."""
    titles = {each["name"]: each["title"] for each in (*block["learned"], *block["baselines"])}
    for each in block["learned"]:
        groups: dict[tuple[str, ...], list[str]] = {}
        for row in block["rows"]:
            rivals = {found["against"]: None for found in row["judgements"] if found["policy"] == each["name"]}
            if named := tuple(titles[rival] for rival in rivals if rival):
                groups.setdefault(named, []).append(row["title"])
        for named, rows in groups.items():
            where = f" ({'; '.join(rows)})" if len(groups) > 1 else ""
            yield f"Verdicts on {each['title']}{where} are against: {'; '.join(named)}."


def marked(baseline: Mapping[str, Any]) -> str:
    """The title of a baseline, with a mark where intervals of differences to it leave something out."""
    return f"{baseline['title']}{MARK if baseline['caution'] else ''}"


def cautions(block: Block) -> Iterator[str]:
    """What the marks of baselines mean."""
    for each in block["baselines"]:
        if each["caution"]:
            yield f"{marked(each)}: {each['caution']}."


def optimum(block: Block, row: Mapping[str, Any]) -> str:
    """What is known to be the best possible in a row; empty where nothing is."""
    known = [each for each in block["baselines"] if each["name"] in row["scores"] and each["optimum"]]
    found = [f"{each['title']} {number(block, row, row['scores'][each['name']]['mean'])}" for each in known]
    if best := row.get("best_known"):
        titles = {each["name"]: each["title"] for each in block["learned"]}
        shares = [f"{titles[name]} {share:.0%}" for name, share in row["shares"].items()]
        found.append(f"best known {number(block, row, best)}{' (' + ', '.join(shares) + ')' if shares else ''}")
    return "; ".join([*found, *([row["bound"]] if row["bound"] else [])])


def verdicts_of(block: Block, name: str) -> list[str]:
    """The verdicts on a learned policy, row by row."""
    return [row["verdicts"][name] for row in block["rows"] if name in row["verdicts"]]


def overall(block: Block, name: str) -> str:
    """The verdicts on a learned policy in a few words."""
    found = verdicts_of(block, name)
    if not found:
        return "not judged"
    counts = count_verdicts(found)
    if len(counts) == 1:
        return worst(found) if len(found) == 1 else f"{worst(found)}, all {len(found)} rows"
    return ", ".join(f"{verdict} {count}" for verdict, count in counts.items()) + f" of {len(found)} rows"


def headline_row(block: Block, name: str) -> Mapping[str, Any]:
    """The row that stands for a block in a summary of a learned policy: not one in which only others are judged."""
    mine = [row for row in block["rows"] if not row["verdicts"] or name in row["verdicts"]]
    chosen = [row for row in mine if row["headline"]]
    judged = [row for row in mine if row["verdicts"]]
    found: Mapping[str, Any] = (chosen or judged or mine)[0]
    return found
