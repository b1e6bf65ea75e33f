"""The page of the leaderboard: who leads in each track of the challenge, and what each panel is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cps_agents.scoring.board import VERSION, BoardEntry, agreement, table
from cps_agents.scoring.exploits import KNOWN, Exploit
from cps_agents.scoring.frozen import Frozen, read_frozen
from cps_agents.scoring.tracks import CHALLENGE, tracks
from cps_agents.sheet import Sheet
from cps_envs.core.policies.lookup import parsed
from cps_envs.registration import find_problem

LONGEST = 120  # characters of a reference
INTRODUCTION = f"""# Leaderboard of {CHALLENGE}

Scores, kinds and ranks of every entry, as [the challenge](challenge.md) defines them, frozen at {VERSION}. Continuous
integration has played them all and written every number. [Submit](submit.md) says how to add a row.
`cps-envs score board` prints the same.

* **Kind**: a controller, hand-set or tuned by search; a network, from scratch or advised by a controller; code; or
  privileged.
* **Rank** is among entries of one kind; both kinds of controllers share one ranking. Entries share a rank where
  their difference, in pairs on the same episodes, may be chance. A privileged entry has none.
* **Return as score**: 0 is the best policy that never looks, 100 the reference of the track; more is better. ± is half
  of a 95 % interval over training seeds and episodes. Of several training seeds the worst is named.
* **Began at**: what the same wiring scores before any training. **Training added** is the difference, with interval.
* **Worst opponent**: the lowest score against one opponent of the panel.
* **Best response**: the attacker's return when the strongest known opponent plays this entry, in the unit of the game,
  with who found it: `known` are shipped policies, `search` tries numbers, `shared-ppo` is our own PPO
  (`cps-envs best-response --entry`). Of several training seeds the one that fares worst is shown. A stronger opponent
  may exist. A dash means that nobody has looked.
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
    spent = {row.name: row.score.cpu_s for row in rows if row.score.kind.network}
    facts = [
        f"Score 0, {_short(frozen.zero_policy)}: the attacker's return is {frozen.zero:.3g}{unit}.",
        f"Score 100: {frozen.told:.3g}{unit}.",
        f"Both from {frozen.episodes} episodes of each opponent; a score takes {track.episodes}.",
        *(f"The score of `{name}` took {each:.0f} CPU s." for name, each in list(spent.items())[:1]),
        *filter(None, [agreement(rows)]),
        *(
            gained(each, f"{row.name}?seed={seed}" if seed else row.name, problem.unit)
            for row in rows
            for seed, each in row.exploits.items()
        ),
        f"Digest `{frozen.digest}`.",
    ]
    return "\n".join(f"* {each}" for each in facts)


def gained(exploit: Exploit, entry: str, unit: str) -> str:
    """What the searches gained over the best known response to the entry of this name, as a sentence."""
    finder, known = (exploit.over, exploit.response) if exploit.by == KNOWN else (exploit.by, exploit.over)
    gain = f"gains {exploit.gain:.3g}{unit and f' {unit}'} over {parsed(known).title}"
    return f"Against `{entry}`: {exploit.pay.mean:.3g}; {finder} {gain}, in {exploit.pay.episodes} episodes."


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
    return Sheet("", ("opponent", "policy", "weight", "return against the reference", "reference"), cells)
