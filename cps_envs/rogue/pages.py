"""The documentation pages of the environments: what the rogue-vehicle problem shows to whoever plays it."""

STORY = """\
One car in the middle of a platoon no longer obeys its computer: somebody else drives it. It can only accelerate and
brake, and it wants the cars around it to collide. Rocking back and forth does it, if the rhythm is right for the
controllers of the others. The defender drives the honest cars. They can ignore the car ahead or the one behind, or
hand over to their drivers, but first they have to find out which car is the rogue.
"""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | the effort of the seized vehicle | controllers and separations of the others, or their accelerations |
| sees | its own speed, the gaps ahead and behind | all gaps, speeds, orders and alarms; noisy in `learning` |
| knows | who is seized, from when on, with what engine | in `paper` who is seized; in `learning` nothing |
| pays for | nothing | leaving the formation, in `easy` and `learning` |
"""

ATTACK = """\
Drive one vehicle of a platoon so that its neighbours collide as hard as possible.

## Story
{story}
## Description
Five vehicles drive at 25 m/s, 9 m apart between centres. The middle one is seized: it accelerates and brakes as the
attacker wants, while the others keep the platoon, detect the attack and follow or leave the attacker. A seized
vehicle may have a stronger engine than the others (`power_ratio`). Vehicles are numbered 1 (rear) to n (leader).
In preset `learning` there are 4 to 8 vehicles, any but the leader is seized, the defender is not told which, and a
quarter of the episodes has no attack: then the action has no effect.

## Threat Model
{threats}
## Action Space
`Box(-1, 1, (1,), float32)` every 0.1 s (`attack_hold_s`), the effort held until then: -1 is F-, full braking, 1 is
F+, full driving, and 0 the effort that keeps the speed of the moment, with linear interpolation on each side;
`cps_envs.rogue.actions.action_of_effort` gives the action of an effort. Before `onset_s` the vehicle drives by
the sliding mode, or with `orders="all"` as the defender orders, and the action has no effect. Nobody drives in reverse.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.

{observation_table}

## Rewards
The increase of the damage D (5.8) over all neighbouring pairs, plus `formation_weight_mps2` times the increase of the
formation cost (presets `easy` 0.5, `learning` 0.2). With `contact="pass"`, the paper's accounting, vehicles pass
through one another and D is the distance moved relative to one another while in contact or in the wrong order, in m.
With `contact="solid"` they collide inelastically and D is the sum of the impact speeds, in m/s; pushing does not
count. The undiscounted return equals `info["damage"] + info["formation_charge"]`.

## Starting State
Steady state: separations of 9 m, 25 m/s, the leader on its reference; perturbed in preset `learning`, which also
draws the number of vehicles, the seat, the power ratio, drive, drag, reference speed, and whether and when the attack
begins.

## Episode End
Truncated after 100 s (`paper`, `oscillation`, `seats`) or 60 s. Nothing terminates an episode.

## Arguments
`preset` ("paper", "oscillation", "seats", "easy", "learning"), `opponent` (a defender: name, "module:attribute" or
policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.rogue.config.RogueConfig`:

{parameter_table}

## References
Dissertation, chapter 5: equations (5.1) to (5.15), Table 5.1, Figs. 5.1 to 5.11.

## Version History
* v0: first version.
"""

DEFENSE = """\
Drive the intact vehicles of a platoon so that the one that an attacker drives does little damage.

## Story
{story}
## Description
The other side of `RogueAttack`. The vehicles' controllers and detectors run inside the simulation at every integration
step. Every 0.1 s the defender selects each vehicle's controller or, with `defense_action="command"`, its acceleration.
In preset `learning` it is not told who is seized: it gives orders to all, the seized vehicle obeys until the onset and
ignores its own from then on, and it reports what an intact vehicle in its place would report.
A detector integrates, for each side, the square of what the neighbour's acceleration is beyond
closing the error with us; the first to pass `alarm_threshold` raises the vehicle's alarm for good.

## Threat Model
{threats}
## Action Space
`MultiDiscrete([6, 2] * (n - 1))`: for each intact vehicle from the rear to the leader (with `orders="all"` for each of
the n vehicles; where n is drawn, for the most there can be, and those beyond the leader have no effect) its controller,

| Controller | | |
|---|---|---|
| 0 | `linear` | bidirectional proportional-derivative (5.15); the neutral action |
| 1 | `sliding` | sliding mode on both sides (5.9) to (5.11) |
| 2 | `front` | sliding mode on the vehicle ahead, for the leader on its reference |
| 3 | `rear` | sliding mode on the vehicle behind; the rear vehicle keeps its speed |
| 4 | `human` | a human driver (2.5), who ignores what is behind |
| 5 | `detecting` | `sliding` until the vehicle's alarm, then `front` or `rear`, the side of the alarm |

and whether following one side is plain (0) or modified (1): with less authority near the set-point, (5.12), and
with the separation growing by 0.5 m at every multiple of 0.1 s while the error is below 0.1 sigma, (5.14). So the
paper's controllers are `linear`; `sliding`; `detecting`; and `detecting` modified, then `human` for all once the
separation of one that follows has grown enough.

With `defense_action="command"` `Box(-1, 1, (n - 1,), float32)` (n with `orders="all"`): accelerations before drag, -1
for -7.5 m/s2, 0 for none, 1 for 2.5 m/s2 (full effort at 25 m/s), held for 0.1 s.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back.

{observation_table}

## Rewards
Minus the attacker's: minus the increase of the damage D (5.8), minus `formation_weight_mps2` times the increase of
the formation cost, which is the time integral of half the intact vehicles' mean speed error (over v_ref) and half
their mean separation error (over 10 sigma), each limited to 1. With `formation_cost="log_place"` (`learning`) it is
the time integral of log(1 + d), d the vehicles' mean distance from their places behind the reference in sigma,
without the seized vehicle from the onset on. Without a price (`paper`) driving apart wins at once. The undiscounted
return equals `-(info["damage"] + info["formation_charge"])`.

## Starting State
Steady state: separations of 9 m, 25 m/s, the leader on its reference; perturbed in preset `learning`, which also
draws the number of vehicles, the seat, the power ratio, drive, drag, reference speed, and whether and when the attack
begins, and adds sensor noise to what is observed (not to what the vehicles' own controllers and detectors see).

## Episode End
Truncated after 100 s (`paper`, `oscillation`, `seats`) or 60 s. Nothing terminates an episode.

## Arguments
`preset` ("paper", "oscillation", "seats", "easy", "learning"), `opponent` (an attacker: name, "module:attribute" or
policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.rogue.config.RogueConfig`:

{parameter_table}

## References
Dissertation, chapter 5: equations (5.1) to (5.15), Table 5.1, Figs. 5.1 to 5.11.

## Version History
* v0: first version.
"""

RHYTHM = "every 0.1 s"  # of the parallel form
SWARM = "The decentralised defence: one agent per intact vehicle with its own sensors, see `cps_envs.rogue.swarm`."
