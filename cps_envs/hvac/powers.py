"""What an attacker reaches beside readings: heating commands, set-points, and messages that it keeps from arriving."""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.declare.config import extremes
from cps_envs.hvac.parameters import Parameters

READINGS, COMMANDS = "readings", "commands"  # words of the field `denial`
ABSENT = -1


class Powers(NamedTuple):
    """Where each power begins in the attacker's action; `ABSENT` where the configuration does not give it."""

    base: int  # what forged readings are based on, 1 entry
    commands_at: int  # n entries
    references_at: int  # n entries
    deny_readings_at: int  # 1 entry
    deny_commands_at: int  # 1 entry
    entries: int  # of the whole action; the first S forge readings

    @property
    def beyond_readings(self) -> bool:
        """Whether the attacker can do anything but forge readings."""
        return max(self[1:5]) != ABSENT


def powers_of(config: Parameters) -> Powers:
    """The layout of the attacker's action: S entries for readings, then those that the configuration asks for."""
    n, end, places = config.num_zones, config.num_sensors, list[int]()
    for present, size in (
        (config.attack_action == "any", 1),
        (extremes(config.command_attack_w)[1] > 0.0, n),
        (extremes(config.reference_attack_c)[1] > 0.0, n),
        (READINGS in config.denial, 1),
        (COMMANDS in config.denial, 1),
    ):
        places.append(end if present else ABSENT)
        end += size if present else 0
    return Powers._make((*places, end))
