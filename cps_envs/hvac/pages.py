"""The documentation pages of the environments: what the HVAC problem shows to whoever plays it."""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | the readings of the compromised sensors | which sensors, filter or model the controller believes |
| may also touch, by fields | commands, set-points, messages | thermostats that hear neither |
| sees | true temperatures; in `paper` and `easy` the last choice | all readings, residuals, estimates, heating |
| knows | who is compromised, and from when on | neither |
| is charged for | nothing | nothing, but in `learning` the model alone drifts away |
"""

ATTACK = """\
Forge temperature sensors of a heated building so that its rooms leave the 25 C that they should have.

## Description
A model predictive controller heats four zones to 25 C by what the sensors say, every 120 s for a day. The attack
begins at the onset. From then on the attacker replaces the readings of the compromised sensors. The defender chooses
what the controller gets: the raw readings, an estimate from a set of sensors that it believes, or the model alone.

## Threat Model
{threats}
## Action Space
`Box(-1, 1, (S + 1,), float32)` at every step: one entry for each of the S sensors, then one that says what the forged
readings are based on. An entry `a` counts in units of 15 C, half the sensor range. The next reading of a compromised
sensor is:

| Entry S + 1 | Reading, clipped to the sensor range [10, 40] C |
|---|---|
| below -1/3 | true temperature of the zone + 15 a |
| between | own noisy measurement + 15 a; a = 0 leaves it alone |
| above 1/3 | 25 + 15 a, the middle of the sensor range + 15 a |

With `attack_action="bias"` there is no such entry, and the middle row holds. Entries of honest sensors have no effect,
and before the onset no entry has. Both roles move at the same time. The attacker's action of step k forges the
readings of k + 1, and the defender's follows from those of k. The readings of k = 0 are never forged.
`cps_envs.hvac.attack.absolute_action` and `bias_action` write actions in C.

Three fields give the attacker more entries, in this order, and `with_powers` writes them. They change commands and
set-points of step k, from the onset on:

| Field | Entries | Meaning |
|---|---|---|
| `command_attack_w` | one per zone | times the field, added to the heating command within the plant's limits |
| `reference_attack_c` | one per zone | times the field, by which the set-point moves that the controller hears |
| `denial=("readings",)` | 1 | above 1/3 no readings arrive, and all sensors show the last |
| `denial=("commands",)` | 1 | above 1/3 no commands arrive, and zones are heated as before |

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.
With `attacker_view="grey"` it ends with `time_of_day`. With `attacker_sees_choice=False` it lacks `last_choice`,
`last_estimate` and `heating`. Presets `learning` and `hard` do this.

{observation_table}

## Rewards
`(x(k + 1) - x_r)^2 / T_a`, summed over zones, in C2 (degrees squared). Here x is a zone's temperature, x_r the desired
one, and T_a the number of states from the onset t_0 to the end. Before the onset the reward is 0. If t_0 = 0, the
first reward also has the term of x(0). The undiscounted return is exactly A_impact (4.19), `info["a_impact"]`. It
ranges from 1 to thousands, so scale it for training.

With `payoff="discomfort"` the return is `info["discomfort_h"]`: hours since the onset that zones are further than
`comfort_c` from x_r. With `payoff="energy"` it is the heating, `info["attack_kwh"]`. `payoff` also takes weights of the
metrics in `info`, or a function of their growth.

## Starting State
All zones at 24 C at midnight, heating off. The presets draw the rest at each reset:

- `easy` draws the onset, how many sensors are compromised, and which. It also draws the building's matrix A_c within
  2 %, and an unmeasured heat within 50 W in each zone; the controller and the observer do not know these two.
- `learning` is colder outside, so that a lie of either sign matters. It draws zero to three compromised sensors, and
  an onset after the observer's window is full. In each zone heat drifts by 50 to 150 W, and the weather differs from
  its forecast.
- `hard` is `learning` with 150 W in every zone.
- `weather` is `learning` on real days: the outdoor temperature is that of a typical year at Sand Point, Alaska, by the
  hour (`outdoor_c`). A day begins at a drawn midnight, for training and for judgements in weeks by turns
  (`series_split`, `series_block_s`).

## Episode End
Terminated after 719 decisions, at state x(719), never before.

## Arguments
`preset` ("paper", "easy", "learning", "hard", "weather"), `opponent` (a defender: name, "module:attribute" or policy),
`render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.hvac.config.HvacConfig`:

{parameter_table}

## References
Dissertation, chapter 4 and appendix C: equations (4.1) to (4.33), Algorithms 3 and 4.

## Version History
* v0: first version.
"""

DEFENSE = """\
Choose which temperature sensors to believe while some of them lie.

## Description
The other side of `HvacAttack`. When the attack begins, at the onset, some sensors of a heated building start to show
what the attacker wants. At every step the defender chooses what its controller gets: the raw readings, an estimate of
all temperatures, or the model's prediction. A moving-horizon observer makes the estimate from a set of sensors, over
the last N_e = 200 samples.

## Threat Model
{threats}
## Action Space
`Discrete(sets + 2)`: there are 14 sets with four sensors and 64 with eight, in the order of
`cps_envs.hvac.sensors.sensor_sets`. With `kalman_filters=True`, as in presets `learning` and `hard`, it is
`Discrete(2 sets + 4)`.

| Action | The controller gets |
|---|---|
| 0 | the raw readings, averaged over a zone's sensors: no defence |
| i = 1..sets | the estimate from set i |
| sets + 1 | the model's prediction from the last estimate: no sensors |
| sets + 1 + i | the estimate of a Kalman filter that has used the sensors of set i all day |
| 2 sets + 2 | that of the filter of all sensors |
| 2 sets + 3 | that of the filter without sensors |

With `thermostats=True` there is one more action, the last: thermostats on the spot heat each zone by its raw readings.
They switch `hysteresis_c` from the set-point, and hear no commands and no set-points from elsewhere.

The filters also estimate heat that no sensor measures. The other estimates take it for zero.

Until the window of N_e samples is full (`ready`), `info["action_mask"]` and `action_masks()` allow only 0, sets + 1 and
thermostats. Sets + 1 then means recursive least squares of all sensors. Moving target defences draw among the sets
that `better_half` (MTD1) or `passes` (MTD2) marks in the observation.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back. The
defender does not observe true temperatures, the onset, or who is compromised. `info` has the metrics.

{observation_table}

## Rewards
The attacker's reward with the opposite sign: `-(x(k + 1) - x_r)^2 / T_a`, summed over zones, from the onset on. The
return is exactly minus A_impact (4.19). With another `payoff` it is minus the hours of zones out of comfort, or minus
the heating in kWh.

## Starting State
All zones at 24 C at midnight, heating off. `HvacAttack` says what the presets draw. Train with `learning`: in `paper`
the model and the weather forecast are exact, so ignoring all sensors is as good as any defence.

## Episode End
Terminated after 719 decisions, at state x(719), never before.

## Arguments
`preset` ("paper", "easy", "learning", "hard", "weather"), `opponent` (an attacker: name, "module:attribute" or policy),
`render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.hvac.config.HvacConfig`:

{parameter_table}

## References
Dissertation, chapter 4 and appendix C: equations (4.1) to (4.33), Algorithms 3 and 4.

## Version History
* v0: first version.
"""

RHYTHM = "every 120 s"  # of the parallel form

SWARM = "The defence with one agent per thermometer, which says whether it is believed. Take preset `learning`."
