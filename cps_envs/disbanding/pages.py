"""The documentation pages of the environments: what the disbanding problem shows to whoever plays it."""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | 1 to 3 platoons; in `learning` also one radio link at a time | accelerations of intact vehicles |
| sees | speeds and gaps of every platoon | every vehicle's speed, gap and command |
| knows | when it will strike, and whether it may at all | who is disbanded; in `learning` late, by a bad radio |
| is charged for | each attack counts against its budget | collisions; in `learning` also noise |
"""

ATTACK = """\
Disband platoons of vehicles so that the traffic behind them suffers.

## Description
N = 10 platoons of n = 10 vehicles drive in one lane at 31 m/s. When a platoon is disbanded, human drivers take over.
They want much larger gaps, so the platoon slows down and disturbs all the traffic behind it. The attacker chooses
which platoons to disband, and when. The defender corrects the commanded accelerations of the intact vehicles behind.

## Threat Model
{threats}
## Action Space
`Discrete(N + 1)`, once per second: 0 waits, i disbands the paper's platoon i (1 = rear, N = front). Each platoon
can be disbanded once, from 1 s on, while the budget lasts. Any other choice means waiting. `info["action_mask"]` and
`action_masks()` tell what is legal. With a budget of jamming, as in preset `learning`, the space is `Discrete(2 N)`.
Action N + i then blocks the radio link ahead of platoon i.

With `attack="jolt"`, as in preset `drivers`, no message disbands a platoon. i then makes one vehicle of platoon i
brake by `jolt_mps2` for `jolt_s`, and each jolt counts against the budget. A driver takes over, after `reaction_s`,
when alarmed: by braking beyond `alarming_braking_mps2`, a jerk beyond `alarming_jerk_mps3`, or a gap below
`alarming_gap_m`. When the first driver takes over, the platoon is disbanded.

In preset `learning`, adapter `from_front` chooses when to strike, whom, and whether to jam. A step lasts until that is
done and something can be chosen again, at most 60 s. Platoons are counted from the front among those that are left, so
every choice can be carried out, also without masks.


## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.

{observation_table}

The table is of preset `paper`. In `learning` the attacker also sees `opens_in_s`, `jam_left_s` and `jammed`.

## Rewards
The increase of the mean velocity error E_v (2.8), in percent, plus the collision penalty. Presets `easy` and
`learning` charge 0.3 points for each intact vehicle in a collision, scaled by 100 / M for M vehicles. The
undiscounted return equals `info["velocity_error_all"] + info["collision_penalty"] + info["end_charge"]`.

## Starting State
Steady state at 31 m/s, with gaps x_d inside platoons and h v_d = 46.5 m between them. Presets `easy` and `learning`
perturb it.

## Episode End
Terminated after 180 s; with `on_collision="end"` also at the first collision of an intact vehicle.

## Arguments
`preset` ("paper", "one_vehicle", "drivers", "easy", "learning"), `opponent` (a defender: name, "module:attribute" or
policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.disbanding.config.DisbandingConfig`:

{parameter_table}

## References
Dissertation, chapter 2: equations (2.1) to (2.9), Tables 2.1 to 2.3.

## Version History
* v0: first version.
"""

DEFENSE = """\
Correct the commands of intact vehicles so that a disbanded platoon disturbs the traffic as little as possible.

## Description
The other side of `DisbandingAttack`. When a platoon ahead disbands, each intact vehicle behind it may add a
correction to the acceleration that its platoon law commands. Collision avoidance (2.6) acts last and cannot be
overridden.

## Threat Model
{threats}
## Action Space
`Box(-1, 1, (M,), float32)` every 0.1 s, one entry for each of the M vehicles from front to rear. An entry counts in
units of 6 m/s2 (u_max - u_min). With `defense_action="platoon"` the shape is `(N,)`, and row i - 1 is the paper's
platoon i. A correction below 0.05 m/s2 changes nothing. A larger one is added to the law's command, which is first
clipped to [u_min, u_max]. Corrections act on intact vehicles behind the most forward disbanded platoon (`mitigable`).
In `learning` they act on every intact vehicle at any time, and the rule grows from nothing: up to 1 m/s2 the clipping,
and the noise of the actuator, are in proportion to the correction.

Learners of preset `learning` meet adapter `parts_road` instead, `MultiDiscrete([3] * 5)` every 10 s. It adds parts of a
follower to the law of all platoons. With level 1 of all parts nothing is added.

| part | 0 | 1 | 2 |
|---|---|---|---|
| acceleration of the vehicle ahead, gain | -0.2 | 0 | 0.8 |
| closing speed, 1/s | -0.3 | 0 | 1.2 |
| room beyond the wanted gap, 1/s2 | -0.025 | 0 | 0.1 |
| speed of the disbanded vehicle, as the record tells, 1/s | -0.075 | 0 | 0.3 |
| share of the plain law | 1.25 | 1 | 0.3, and the lag is made up for |

The wanted gap is 10 m, and 0.2 s more for leaders. No single part is a follower, and neutral levels leave the law as
it is. Constant actions are strong in this role: with all parts at level 2 one scores 88.8 ± 3.2 on split dev of the
challenge, and the tuned follower `cacc` 96.4 ± 0.9.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back.

{observation_table}

In preset `drivers` the broadcast says nothing until a driver has taken over.

The table is of preset `paper`. In `learning` the warning travels from vehicle to vehicle, so `disbanded` is not
observed. A vehicle's record is what it has heard of the nearest disbanded vehicle. `warned` tells whether there is a
record, and `record_age_s` how old it is. `ahead_*` shows the record of each vehicle q >= n. All vehicles also send
heartbeats: `silence_s` is the time since the last one came through. In peace that is short, behind a jam it grows.
`mitigable` covers all vehicles.

## Rewards
The attacker's reward with the opposite sign. It falls by the increase of E_v (2.8) over all vehicles, in percent,
and by the collision penalty.

## Starting State
As in `DisbandingAttack`.

## Episode End
Terminated after 180 s; with `on_collision="end"` also at the first collision of an intact vehicle. The
rest of the episode is then charged at 100 %.

## Arguments
`preset` ("paper", "one_vehicle", "drivers", "easy", "learning"), `opponent` (an attacker: name, "module:attribute" or
policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.disbanding.config.DisbandingConfig`:

{parameter_table}

## References
Dissertation, chapter 2 and appendix A: equations (2.1) to (2.14), Tables 2.1 to 2.3.

## Version History
* v0: first version.
"""

RHYTHM = "every 0.1 s; the attacker may act at whole seconds"  # of the parallel form
SWARM = "The decentralised defence, with one agent per vehicle. See `cps_envs.disbanding.swarm`."
