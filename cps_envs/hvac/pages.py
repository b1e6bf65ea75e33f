"""The documentation pages of the environments: what the HVAC problem shows to whoever plays it."""

STORY = """\
A computer heats a house by what its temperature sensors say. An attacker has taken over some of the sensors and shows
readings of its choice: the rooms get too hot or too cold while the display says that all is well. The defender does
not know who lies. It moves the target: at each step it chooses a set of sensors to believe, and the liars hope to be
in it.
"""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | the readings of the compromised sensors | which sensors, filter or model the controller believes |
| sees | true temperatures; in `paper` and `easy` the last choice | all readings, residuals, estimates, heating |
| knows | who is compromised, and from when on | neither |
| pays for | nothing | nothing, but in `learning` the model alone drifts away |
"""

ATTACK = """\
Forge temperature sensors of a heated building so that its rooms leave the 25 C that they should have.

## Story
{story}
## Description
A model predictive controller heats four zones to 25 C by what the sensors say, every 120 s for a day. From the
onset on the attacker replaces the readings of the compromised sensors. The defender feeds the controller with the
raw readings, or with an estimate from a set of sensors that it believes, or with the model alone.

## Threat Model
{threats}
## Action Space
`Box(-1, 1, (S + 1,), float32)` at every step: one entry per sensor, then what the forged readings are based on.
Half the sensor range, 15 C, is the unit of an entry `a`; the reading of a compromised sensor at the next step is

| Last entry | Reading, clipped to the sensor range [10, 40] C |
|---|---|
| below -1/3 | true temperature of the zone + 15 a |
| between | own noisy measurement + 15 a; a = 0 leaves it alone |
| above 1/3 | 25 + 15 a, the middle of the sensor range + 15 a |

With `attack_action="bias"` there is no last entry, and the middle row holds. Entries of sensors that are not
compromised, and all of them before the onset, have no effect. Both roles move at the same time: the action of step
k forges the readings of k + 1, the defender's answers those of k. The readings of k = 0 are never forged.
`cps_envs.hvac.attack.absolute_action` and `bias_action` write actions in C.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.
With `attacker_view="grey"` it ends with `time_of_day`. With `attacker_sees_choice=False`, as in presets `learning` and
`hard`, it has no `last_choice`, `last_estimate` and `heating`.

{observation_table}

## Rewards
|x(k + 1) - x_r|^2 / T_a, summed over zones, in C2, for the states from the onset t_0 to the end, of which there are
T_a; before the onset 0. If t_0 = 0, the first reward has the term of x(0) too. The undiscounted return is A_impact
(4.19), `info["a_impact"]`, exactly. It grows from 1 to thousands: scale it for training.

`payoff="discomfort"` pays the hours that zones are further than `comfort_c` from x_r since the onset, summed over
zones (`info["discomfort_h"]`); `payoff="energy"` pays the heating since the onset (`info["attack_kwh"]`).

## Starting State
All zones at 24 C at midnight, heating off. Preset `easy` draws the onset, number and identity of the compromised
sensors, entries of the building's A_c within 2 %, and an unmeasured heat within 50 W in each zone; the controller and
the observer do not know the last two. Preset `learning` is colder outside, so that a lie of either sign matters. It
draws no to three compromised sensors, an onset once the window is full, heat that drifts by 50 to 150 W in each zone,
and an outside that is not as forecast. Preset `hard` is `learning` with 150 W in every zone.

## Episode End
Truncated after 719 decisions, at state x(719). Never terminated.

## Arguments
`preset` ("paper", "easy", "learning", "hard"), `opponent` (a defender: name, "module:attribute" or policy),
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

## Story
{story}
## Description
The other side of `HvacAttack`: from the onset on some sensors of a heated building show what the attacker wants.
At every step the defender chooses what its controller gets: the raw readings, an estimate of all temperatures from
a set of sensors by a moving-horizon observer over the last N_e = 200 samples, or the model's prediction.

## Threat Model
{threats}
## Action Space
`Discrete(sets + 2)`, 14 sets with four sensors and 64 with eight, in the order of
`cps_envs.hvac.sensors.sensor_sets`. With `kalman_filters=True`, as in presets `learning` and `hard`, it is
`Discrete(2 sets + 4)`:

| Action | The controller gets |
|---|---|
| 0 | the raw readings, averaged over a zone's sensors: no defence |
| i = 1..sets | the estimate from set i |
| sets + 1 | the model's prediction from the last estimate: no sensors |
| sets + 1 + i | the estimate of a Kalman filter that has used the sensors of set i all day |
| 2 sets + 2 | that of the filter of all sensors |
| 2 sets + 3 | that of the filter without sensors |

The filters estimate the heat that nobody measures too, which the other estimates take for zero.

Until the window of N_e samples is full (`ready`) only 0 and sets + 1 are legal by `info["action_mask"]` and
`action_masks()`, and every action but 0 means the recursive least squares of all sensors. Moving target defences
draw among the sets that `better_half` (MTD1) or `passes` (MTD2) marks in the observation; both answer the newest
readings and are computed in full precision.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back. True
temperatures, onset and compromised sensors are not observed; `info` has the metrics.

{observation_table}

## Rewards
Minus the attacker's: -|x(k + 1) - x_r|^2 / T_a from the onset on. The return is minus A_impact (4.19), exactly. With
another `payoff` it is minus the hours of zones out of comfort, or minus the heating in kWh.

## Starting State
All zones at 24 C at midnight, heating off; see `HvacAttack` for what the presets draw. With an exact model and exact
weather (preset `paper`), ignoring all sensors is as good as any defence: train with `learning`.

## Episode End
Truncated after 719 decisions, at state x(719). Never terminated.

## Arguments
`preset` ("paper", "easy", "learning", "hard"), `opponent` (an attacker: name, "module:attribute" or policy),
`render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.hvac.config.HvacConfig`:

{parameter_table}

## References
Dissertation, chapter 4 and appendix C: equations (4.1) to (4.33), Algorithms 3 and 4.

## Version History
* v0: first version.
"""

RHYTHM = "every 120 s"  # of the parallel form
