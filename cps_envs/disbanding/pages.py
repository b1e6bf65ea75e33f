"""The documentation pages of the environments: what the disbanding problem shows to whoever plays it."""

STORY = """\
Cars drive in platoons: a computer keeps each car a few metres behind the next one, at 112 km/h. One sensor failure is
enough to dissolve a platoon, because its drivers then take over and want far more room. So an attacker who can spoof
a sensor in the right platoon at the right time starts a wave of braking that runs through all the traffic behind. The
defender cannot undo the attack. It may only ask the platoons behind to make room early and gently, without stopping
or crashing themselves.
"""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | 1 to 3 platoons; in `learning` also one radio link at a time | accelerations of intact vehicles |
| sees | speeds and gaps of every platoon | every vehicle's speed, gap and command |
| knows | when it will strike, and whether it may at all | who is disbanded; in `learning` late, by a bad radio |
| pays for | each attack counts against its budget | collisions; in `learning` also noise |
"""

ATTACK = """\
Disband platoons of vehicles so that the traffic behind them suffers.

## Story
{story}
## Description
N = 10 platoons of n = 10 vehicles drive in one lane at 31 m/s. A disbanded platoon falls back to human drivers, who
want much larger gaps: it slows down, and everything upstream is disturbed. The attacker chooses which platoons to
disband, and when; the defender corrects the commanded accelerations of the intact vehicles upstream.

## Threat Model
{threats}
## Action Space
`Discrete(N + 1)`, once per second: 0 waits, i disbands the paper's platoon i (1 = rear, N = front). A platoon
can be disbanded once, from 1 s on, while the budget lasts; anything else means waiting. `info["action_mask"]` and
`action_masks()` tell what is legal. With a budget of jamming, as in preset `learning`, it is `Discrete(2 N)`:
N + i blocks the radio link ahead of platoon i.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.

{observation_table}

The table is of preset `paper`. In `learning` the attacker also sees `opens_in_s`, `jam_left_s` and `jammed`.

## Rewards
The increase of the mean velocity error E_v (2.8), in percent, plus the collision penalty (`easy`, `learning`: 0.3
points per intact vehicle that becomes involved in a collision, scaled by 100 / M). The undiscounted return equals
`info["velocity_error_all"] + info["collision_penalty"] + info["end_charge"]`.

## Starting State
Steady state at 31 m/s: gaps x_d inside platoons and h v_d = 46.5 m between them; perturbed in `easy`, `learning`.

## Episode End
Truncated after 180 s. Terminated only with `on_collision="end"`, at the first collision of an intact vehicle.

## Arguments
`preset` ("paper", "one_vehicle", "easy", "learning"), `opponent` (a defender: name, "module:attribute" or policy),
`render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.disbanding.config.DisbandingConfig`:

{parameter_table}

## References
Dissertation, chapter 2: equations (2.1) to (2.9), Tables 2.1 to 2.3.

## Version History
* v0: first version.
"""

DEFENSE = """\
Correct the commands of intact vehicles so that a disbanded platoon disturbs the traffic as little as possible.

## Story
{story}
## Description
The other side of `DisbandingAttack`: platoons disband ahead, and the intact vehicles upstream may add a correction
to the acceleration that their platoon law commands. Collision avoidance (2.6) acts last and cannot be overridden.

## Threat Model
{threats}
## Action Space
`Box(-1, 1, (M,), float32)` every 0.1 s, one entry per vehicle from front to rear, times 6 m/s2 (u_max - u_min);
with `defense_action="platoon"` `(N,)`, row i - 1 for the paper's platoon i. A correction below 0.05 m/s2 leaves the
law alone; a larger one is added to the law's command clipped to [u_min, u_max]. It acts only on intact vehicles
upstream of the most forward disbanded platoon (`mitigable`); in `learning` on every intact vehicle at any time.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back.

{observation_table}

The table is of preset `paper`. In `learning` the warning travels from vehicle to vehicle: `disbanded` is not seen,
`ahead_*` has one entry per vehicle q >= n with what its record says, `warned` and `record_age_s` tell whether there is
one and how old it is, and `mitigable` covers all vehicles.

## Rewards
Minus the attacker's: minus the increase of E_v (2.8) over all vehicles in percent, minus the collision penalty.

## Starting State
Steady state at 31 m/s: gaps x_d inside platoons and h v_d = 46.5 m between them; perturbed in `easy`, `learning`.

## Episode End
Truncated after 180 s. Terminated only with `on_collision="end"`, at the first collision of an intact vehicle; the
rest of the episode is then charged at 100 %.

## Arguments
`preset` ("paper", "one_vehicle", "easy", "learning"), `opponent` (an attacker: name, "module:attribute" or policy),
`render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.disbanding.config.DisbandingConfig`:

{parameter_table}

## References
Dissertation, chapter 2 and appendix A: equations (2.1) to (2.14), Tables 2.1 to 2.3.

## Version History
* v0: first version.
"""

RHYTHM = "every 0.1 s; the attacker may act at whole seconds"  # of the parallel form
SWARM = "The decentralised defence: one agent per vehicle, see `cps_envs.disbanding.swarm`."
