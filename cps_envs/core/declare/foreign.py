"""Numbers that were found for one system and are used for another: told in a sentence where something is to play."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cps_envs.core.declare.config import bounds, is_drawn


class ForeignSettingWarning(UserWarning):
    """A number that was found for another system is used."""


def tell(sentences: Iterable[str]) -> None:
    """Warn of each; Python shows a sentence once in a process, from wherever it comes."""
    for sentence in sentences:
        warnings.warn(sentence, ForeignSettingWarning, stacklevel=1)


def other_fields(config: Any, known: Mapping[str, Any], names: Sequence[str]) -> list[str]:
    """Which of these fields of a configuration are other than in any of the `known` ones, those of presets by name.

    A quantity that is drawn is other where it leaves the range of a preset. Of the presets the nearest counts, and the
    first of several.
    """
    drawn = {each.name: is_drawn(each) for each in dataclasses.fields(config)}
    found = [[n for n in names if _is_other(getattr(config, n), getattr(k, n), drawn[n])] for k in known.values()]
    return min(found, key=len, default=[])


def too_late(config: Any, name: str, ends_s: float, ending: str) -> str:
    """A sentence where attacks, which begin at a drawn time of this name, may come after the end; else empty.

    `ending` names the field by which episodes last so long.
    """
    least, most = bounds(getattr(config, name))
    if most < ends_s:
        return ""
    share = 1.0 if least >= ends_s else (most - ends_s) / (most - least)
    return (
        f"{name} = {getattr(config, name)} s lets {max(share, 0.01):.0%} of the attacks begin after the end of the "
        f"episode at {ends_s:g} s: lower it, or raise {ending}"
    )


def _is_other(value: Any, known: Any, drawn: bool) -> bool:
    if not drawn:
        return bool(value != known)
    (low, high), (least, most) = bounds(value), bounds(known)
    return low < least or high > most
