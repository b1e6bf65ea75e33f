"""How selected the configuration is: eight orderings of the maps, on parts of them and under small changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from cps_paper.exhibit import Column, ExhibitTable, across
from cps_paper.rogue.experiments import Overrides, RogueEvidence, Waves, map_rows
from cps_paper.rogue.heat_map import MAPS, PASS, RATIOS, SOLID, WIDE_RATIOS, HeatMap

Maps = Mapping[str, HeatMap]  # by defender
HALF, NEAR_SHARE = 0.5, 0.25
ORDERINGS = (
    "detection's sum at ratio 1 below half of sliding's",
    "pd: mean at low f above twice that at high f",
    "sliding: the same",
    "maximum of detection below pd's (R10)",
    "maximum of detection below sliding's (R11)",
    "maxima of +2 and +4 above detection's (R13, R14)",
    "maximum of +7 within 25 % of detection's (R16)",
    "maximum of +7 below those of +2 and +4 (R15)",
)


@dataclass(frozen=True)
class Variant:
    """Maps under other settings, and the windows of them that are judged."""

    name: str
    contact: str = PASS
    ratios: tuple[float, ...] = RATIOS
    overrides: Overrides = ()
    first_hz: float = 0.0
    last_ratio: float = WIDE_RATIOS[-1]

    def experiments(self) -> list[Waves]:
        """What its maps need."""
        return [
            row for defender in MAPS.values() for row in map_rows(defender, self.contact, self.ratios, self.overrides)
        ]

    def maps(self, evidence: RogueEvidence) -> dict[str, HeatMap]:
        """Its maps, within the window."""
        there = evidence.under(self.contact)
        return {
            defender: there.map(defender, self.ratios, self.overrides).window(self.first_hz, self.last_ratio)
            for defender in MAPS.values()
        }


OWN = (  # of the maps of Figs. 5.6 to 5.11
    Variant("as configured"),
    Variant("f from 0.05 Hz", first_hz=0.05),
    Variant("f from 0.11 Hz", first_hz=0.11),
    Variant("ratios to 1.2", last_ratio=1.2),
    Variant("solid", SOLID),
    Variant("solid, f from 0.05 Hz", SOLID, first_hz=0.05),
)
SHARE = (("inner_share", 0.25),)
FURTHER = (
    Variant("F- = -0.5", overrides=(("min_effort", -0.5),)),
    Variant("F- = 0", overrides=(("min_effort", 0.0),)),
    Variant("n_3 = 0.25", overrides=SHARE),
    Variant("l_2 = 600 as the threshold", overrides=(("alarm_threshold", 600.0),)),
    Variant("ratios to 2", ratios=WIDE_RATIOS),
    Variant("n_3 = 0.25, ratios to 2", ratios=WIDE_RATIOS, overrides=SHARE),
)


def orderings(maps: Maps) -> list[bool]:
    """ORDERINGS, one by one."""
    detection = maps["sliding_detection"]
    early, late = [maps[name].highest for name in ("disband_2", "disband_4")], maps["disband_7"].highest
    return [
        bool(detection.row(1.0).sum() < HALF * maps["sliding"].row(1.0).sum()),
        *(bool(HALF * maps[name].low.mean() > maps[name].high.mean()) for name in ("pd", "sliding")),
        *(detection.highest < maps[name].highest for name in ("pd", "sliding")),
        min(early) > detection.highest,
        abs(late - detection.highest) <= NEAR_SHARE * detection.highest,
        late < min(early),
    ]


def fits(
    evidence: RogueEvidence, variants: tuple[Variant, ...] = (*OWN, *FURTHER)
) -> Iterator[tuple[Variant, Maps, list[bool]]]:
    """Each variant with its maps and the orderings that hold."""
    for variant in variants:
        maps = variant.maps(evidence)
        yield variant, maps, orderings(maps)


def fits_table(evidence: RogueEvidence) -> ExhibitTable:
    """Which orderings of the maps survive."""
    columns = (
        Column("", lambda each: each[0].name),
        *across(range(len(ORDERINGS)), lambda k: f"{k + 1}", lambda each, k: "yes" if each[2][k] else "NO"),
        Column("hold", lambda each: (sum(each[2]), len(each[2])), "{} of {}"),
        Column(
            "maxima: pd, sliding, detection, +2, +4, +7",
            lambda each: ", ".join(f"{heat_map.highest:.0f}" for heat_map in each[1].values()),
        ),
    )
    notes = tuple(f"{k + 1}: {text}." for k, text in enumerate(ORDERINGS))
    title = "How selected the configuration is: what the paper says of the maps"
    return ExhibitTable(title, columns, list(fits(evidence)), notes)


def fits_data(evidence: RogueEvidence) -> dict[str, Any]:
    """The same for JSON."""
    variants = [
        {
            "variant": variant.name,
            "contact": variant.contact,
            "hold": hold,
            "maxima": {defender: heat_map.highest for defender, heat_map in maps.items()},
            "means": {defender: heat_map.mean for defender, heat_map in maps.items()},
        }
        for variant, maps, hold in fits(evidence)
    ]
    return {"orderings": list(ORDERINGS), "variants": variants}
