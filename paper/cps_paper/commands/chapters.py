"""The commands of `cps-envs reproduce` as data: which chapter, under which options, and what their help says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cps_paper.chapter import Chapter

PACKAGES = {  # of the chapters' declarations
    "2": "cps_paper.disbanding",
    "2.5": "cps_paper.testbed",
    "3": "cps_paper.fdi",
    "4": "cps_paper.hvac",
    "5": "cps_paper.rogue",
}


@dataclass(frozen=True)
class Option:
    """A choice that a chapter leaves to its reader."""

    name: str  # as the chapter's evidence takes it
    kind: Any  # int, float, str, bool or one of these or None
    default: Any
    help: str
    metavar: str | None = None
    least: int | None = None


@dataclass(frozen=True)
class Command:
    """The command of a chapter."""

    name: str  # "ch2"
    number: str  # "2", or section "2.5"
    problem: str
    help: str
    quick: str  # what --quick leaves out
    options: Sequence[Option] = ()
    parts: str = ""  # which parts there are; empty where nothing can be chosen
    part_option: str = "table"
    flags: Sequence[str] = ()  # parts that have a flag of their own
    recheck: str = ""  # under what the claims are judged again; empty where they are not
    varied: str = ""  # the option that `reproduce all` varies
    values: Sequence[str] = ()  # by these

    def load(self) -> Chapter[Any]:
        """The chapter's declaration."""
        found: Chapter[Any] = import_module(f"{PACKAGES[self.number]}.chapter").CHAPTER
        return found


COMMANDS = (
    Command(
        "ch2",
        "2",
        "disbanding",
        """Platoon disbanding: Tables 2.2 and 2.3, Figs. 2.1 and 2.3, optimal attacks and every claim.

        `platoons` and `text` play defenders in the environment: for N = 2 to 10, and under what the text only
        describes.

        Cells that differ from the paper are findings and do not fail. The exit code is 1 when our own numbers left the
        reference values of the specification, which means that the simulation has changed.
        """,
        "Leave out long strings, grids, most searches, and what is played.",
        (
            Option("interpretation", str, "S0", "How to read what the paper leaves open: S0, S1, S2."),
            Option("all_interpretations", bool, False, "The baseline under S0, S1 and S2 as well."),
        ),
        "Only this part: 2.2, 2.3, 2.1fig to 2.3fig, tried, platoons, text, ga or claims; may be repeated.",
        recheck="Judge the claims again at half the step and under two rules of the text.",
        varied="interpretation",
        values=("S0", "S1", "S2"),
    ),
    Command(
        "ch3",
        "3",
        "fdi",
        """False data injection: Tables 3.1 to 3.7 cell by cell, their contradictions, and Fig. 3.2.

        The tables are judged by the shipped certificates, with one horizon. No table is reproduced as a whole: the
        individual speeds, Table 3.7, the constants and the colliding pair of Fig. 3.2 cannot be, and the last lines say
        so. Counts of agreement stand beside rules that know less. The exit code is 1 when a count leaves its reference
        by more than 3.
        """,
        "Only the tables with one attacked vehicle, fig and audit.",
        (
            Option(
                "preset_set",
                str,
                "A",
                "Gains and limits: A or B. The paper prints none; both are fitted to its tables.",
                "A|B",
            ),
            Option("nodes", int, 100, "Of each search; one that ends by it is open.", least=1),
            Option("acceptance", float, 0.45, "Largest distance from a grid point that counts as reached."),
        ),
        "Only this part: 3.1 to 3.7, horizons, fig or audit; may be repeated.",
        flags=("audit",),
        varied="preset_set",
        values=("A", "B"),
    ),
    Command(
        "ch4",
        "4",
        "hvac",
        """Heating under sensor attacks: Tables 4.1 and 4.2, Figs. 4.2 to 4.8 and every claim of the text.

        Claims and cells that differ from the paper are findings and do not fail. The exit code is 1 when our own
        numbers left the reference values of the specification, which means that the simulation has changed.
        """,
        "Leave out Table 4.2, eight sensors (Fig. 4.8), their claims, deviation, and attacks before step 200.",
        (Option("controller", str, "clip", "How (4.17) keeps its limits: clip, qp or levels."),),
        "Only this part: 4.1, deviation, 4.2, 4.2fig to 4.8fig, early or claims; may be repeated.",
        recheck="Judge the claims again over days of other seeds; takes twice as long.",
        varied="controller",
        values=("clip", "qp"),
    ),
    Command(
        "ch5",
        "5",
        "rogue",
        """A rogue vehicle in a platoon: Figs. 5.2 to 5.11 and every claim, with both contacts.

        The paper prints no damage. Its orderings come out of a selected configuration only, and the last lines say how
        selected it is. The exit code is 1 when our own damages left the reference values of the specification, which
        means that the simulation has changed.
        """,
        "Leave out seats, together, fit and headroom, unless they are named.",
        parts="5.2, 5.3, 5.4, 5.5, maps, seats, together, claims, fit or headroom; may be repeated.",
        part_option="part",
        recheck="Judge the claims again at half the step and in 20 worlds: 23 times the work.",
    ),
    Command(
        "testbed",
        "2.5",
        "disbanding",
        """Nine robots on a circle, simulated: the three E_v of Fig. 2.5 and every claim of section 2.5.

        Values that differ from the paper are findings and do not fail. The exit code is 1 when our three E_v leave the
        spread of the specification, or do not fall from case to case in nine of ten seeds: then the simulation has
        changed.
        """,
        "Three seeds unless --seeds says otherwise, and no long runs.",
        (
            Option("seeds", int | None, None, "How many; 20 if left out.", least=1),
            Option("damping", str, "k3", "k_d of the robots: k3, or k1 with E_v to the end of the run.", "k3|k1"),
        ),
        varied="damping",
        values=("k3", "k1"),
    ),
)
