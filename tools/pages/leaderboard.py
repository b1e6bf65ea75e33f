"""The page of the boards: who leads in each track of the challenge, and what each panel is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cps_agents.scoring.board import BoardEntry, agreement, table
from cps_agents.scoring.exploits import KNOWN, Exploit
from cps_agents.scoring.frozen import Frozen, read_frozen
from cps_agents.scoring.tracks import CHALLENGE, tracks
from cps_agents.sheet import Sheet
from cps_envs.core.policies.lookup import parsed
from cps_envs.registration import find_problem

LONGEST = 120  # characters of a reference
NETWORK = "network"  # the entry that ships
INTRODUCTION = f"""# Boards of {CHALLENGE}

Each score is a policy's own number in a track of [the challenge](challenge.md): 0 is the best constant action, 100 the
best answer to each opponent that was known at the freeze. More is better in every track. ± is half of a 95 % interval
over episodes and training seeds. Entries share a rank where their difference, in pairs on the same episodes, may be
chance. Told entries know more than their role observes, and have no rank.
[Submit](submit.md) says how to add a row. `cps-envs score board` prints the same.

*Best response* is what the attacker is paid where the strongest opponent that was found plays, with a 95 % interval
over fresh episodes, and what found it: `known` are the computed and shipped policies, `search` tries the numbers of
hand-made ones, `shared-ppo` is our own PPO (`cps-envs best-response --entry`). The less is better for the entry in a
track of defenders, the more in one of attackers. Below stands what the searches gained over the best known. Of a
network, the training seed plays that validation chose. A stronger opponent may exist. Where nobody has looked stands -.
"""


def page(found: Mapping[str, Sequence[BoardEntry]]) -> str:
    """The page as Markdown, of these boards."""
    parts = [INTRODUCTION.rstrip()]
    for track in tracks().values():
        parts.append(f"## {track.name}")
        frozen, rows = read_frozen(track), found[track.name]
        parts.append("\n".join(table(track, rows).markdown()) if rows else "No entry yet.")
        parts.append(_facts(frozen, rows))
        parts.append("\n".join(_panel(frozen).markdown()))
    return "\n\n".join(parts) + "\n"


def _facts(frozen: Frozen, rows: Sequence[BoardEntry]) -> str:
    """What the ends of the scale are paid, what a score takes, and how sure the order is."""
    track, problem = frozen.track, find_problem(frozen.track.problem)
    unit = f" {problem.unit}" if problem.unit else ""
    spent = [row.score.cpu_s for row in rows if row.name == NETWORK]
    facts = [
        f"{_short(frozen.zero_policy)} has score 0: {frozen.zero:.3g}{unit} for the attacker.",
        f"The best answers have score 100: {frozen.told:.3g}{unit}.",
        f"Both from {frozen.episodes} episodes of each opponent; a score takes {track.episodes}.",
        *(f"The score of `{NETWORK}` took {each:.0f} CPU s." for each in spent),
        *filter(None, [agreement(rows)]),
        *(gained(row.exploit, row.name, problem.unit) for row in rows if row.exploit),
        f"Digest `{frozen.digest}`.",
    ]
    return "\n".join(f"* {each}" for each in facts)


def gained(exploit: Exploit, entry: str, unit: str) -> str:
    """What the searches gained over the best known response to the entry of this name, as a sentence."""
    finder, known = (exploit.over, exploit.response) if exploit.by == KNOWN else (exploit.by, exploit.over)
    gain = f"gains {exploit.gain:.3g}{unit and f' {unit}'} over {parsed(known).title}"
    return f"Against `{entry}` {finder} {gain}, in {exploit.pay.episodes} episodes."


def _short(reference: str) -> str:
    """A reference with its numbers, or its name and how many there are."""
    name = parsed(reference).title
    query = reference.removeprefix(name)
    count = query.count("=") + query.count(",")
    return f"`{reference}`" if len(reference) <= LONGEST else f"`{name}`, {count} numbers"


def _panel(frozen: Frozen) -> Sheet:
    """The opponents of a track."""
    track = frozen.track
    cells = [
        [rival.name, _short(rival.reference), f"{share:.0%}", f"{paid.mean():.3g}", _short(rival.answer)]
        for rival, share, paid in zip(track.panel, track.shares, frozen.pays["test"], strict=True)
    ]
    return Sheet("", ("opponent", "policy", "weight", "best answer is paid", "best answer"), cells)
