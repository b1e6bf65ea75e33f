"""The documentation pages of the environments: what the rogue-vehicle problem shows to whoever plays it."""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | the effort of the seized vehicle | controllers and separations of the others, or their accelerations |
| sees | its own speed, the gaps ahead and behind | all gaps, speeds, orders and alarms; noisy in `learning` |
| knows | who is seized, from when on, with what engine | in `paper` who is seized; in `learning` nothing |
| is charged for | nothing | leaving the formation, in `easy` and `learning` |
"""

ATTACK = """\
Drive one vehicle of a platoon so that its neighbours collide as hard as possible.

## Description
Five vehicles drive at 25 m/s, 9 m apart between centres. The attacker has seized the middle one, and makes it
accelerate and brake. The others keep the platoon, detect the attack, and follow or leave the seized vehicle. Its
engine may be stronger than theirs (`power_ratio`). Vehicles are numbered 1 (rear) to n (leader).

In preset `learning` there are 4 to 8 vehicles, and any but the leader may be seized. The defender does not know which.
A quarter of the episodes has no attack: then the action has no effect. `attacker_index` up to `num_vehicles` lets the
leader be seized, too. With `attacker_indices=(2, 4)` one attacker drives several vehicles.

## Threat Model
{threats}
## Action Space
`Box(-1, 1, (k,), float32)` for k seized vehicles, usually one, every 0.1 s (`attack_hold_s`): the effort of the
engine, held until the next action. -1 is full braking, F-, and 1 full driving, F+. 0 keeps the present speed, and
values between are interpolated linearly.
`cps_envs.rogue.actions.action_of_effort` gives the action of an effort. Before `onset_s` the action has no effect:
the vehicle drives by the sliding mode, or with `orders="all"` as the defender orders. Nobody drives in reverse.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.

{observation_table}

## Rewards
The increase of the damage D (5.8) over all neighbouring pairs, plus `formation_weight_mps2` times the increase of the
formation cost. The weight is 0.5 in preset `easy` and 0.2 in `learning`. There an attacker that stands still earns
little: no vehicle has a place beyond it. The undiscounted return equals `info["damage"] + info["formation_charge"]`.

`contact` says what damage is. With `"pass"`, the paper's accounting, vehicles pass through one another. D is then the
distance in m that they move relative to one another while in contact or in the wrong order. With `"solid"` they
collide inelastically, and D is the sum of the impact speeds in m/s. Pushing does not count. Bumpers take
`bumper_mps` of each impact: none in `paper` and `easy`, 2 m/s in `learning`. There an impact at 8 m/s counts as 6 m/s.

## Starting State
Steady state: separations of 9 m, 25 m/s, the leader on its reference. Preset `learning` perturbs it. It also draws the
number of vehicles, which one is seized, the power ratio, drive, drag and the reference speed. Finally it draws
whether there is an attack, and when it begins.

In preset `city` the reference drives a cycle (`leader_speed_mps`): the EPA's UDDS, 23 minutes of stop and go. Episodes
begin at a drawn second of it, for training and for judgements in blocks of two minutes by turns (`series_split`,
`series_block_s`).

## Episode End
Terminated after 100 s (`paper`, `oscillation`, `seats`) or 60 s, never before.

## Arguments
`preset` ("paper", "oscillation", "seats", "easy", "learning", "city"), `opponent` (a defender: name, "module:attribute"
or policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.rogue.config.RogueConfig`:

{parameter_table}

## References
Dissertation, chapter 5: equations (5.1) to (5.15), Table 5.1, Figs. 5.1 to 5.11.

## Version History
* v0: first version.
"""

DEFENSE = """\
Drive the intact vehicles of a platoon so that the seized one does little damage.

## Description
The other side of `RogueAttack`. The vehicles' controllers and detectors run inside the simulation at every integration
step. Every 0.1 s the defender selects each vehicle's controller or, with `defense_action="command"`, its acceleration.
In `learning` it selects for each vehicle one of either.

In preset `learning` the defender does not know who is seized, so it gives orders to all vehicles. The seized vehicle
obeys until the attack begins, at the onset. From then on it ignores its orders, and reports what an intact vehicle in
its place would report.

Each vehicle has a detector for the neighbour on each side. It integrates the square of that acceleration of the
neighbour which does not serve to close the error between the two. The first detector to pass `alarm_threshold` raises
the vehicle's alarm for good.

## Threat Model
{threats}
## Action Space
`MultiDiscrete([6, 2] * (n - 1))`: two entries for each intact vehicle, from the rear to the leader. With `orders="all"`
there are two for each of the n vehicles. Where n is drawn there are entries for the largest n; those beyond the leader
have no effect. The first entry is the vehicle's controller:

| Controller | | |
|---|---|---|
| 0 | `linear` | bidirectional proportional-derivative (5.15); the neutral action, but in `learning` |
| 1 | `sliding` | sliding mode on both sides (5.9) to (5.11); the neutral action of `learning` |
| 2 | `front` | sliding mode on the vehicle ahead, for the leader on its reference |
| 3 | `rear` | sliding mode on the vehicle behind; the rear vehicle keeps its speed |
| 4 | `human` | a human driver (2.5), who ignores what is behind |
| 5 | `detecting` | `sliding` until the vehicle's alarm, then `front` or `rear`, the side of the alarm |

The second entry says whether following one side is plain (0) or modified (1). The modified law has less authority near
the set-point, (5.12). Its separation grows by 0.5 m at every multiple of 0.1 s while the error is below 0.1 sigma,
(5.14). The paper's controllers are `linear`, `sliding`, `detecting`, and `detecting` modified. The last one hands all
vehicles to `human` once the separation of one that follows has grown enough.

With `defense_action="command"` the space is `Box(-1, 1, (n - 1,), float32)`, or n entries with `orders="all"`. Entries
are accelerations before drag, held for 0.1 s: -1 for -7.5 m/s2, 0 for none, 1 for 2.5 m/s2 (full effort at 25 m/s).
`learning` has `defense_action="either"` and `MultiDiscrete([11, 2] * n)`: after the controllers there are five such
accelerations, 6 for -1, 7 for -0.5, 8 for 0, 9 for 0.5, and 10 for 1. A vehicle that plays one shows no law.



## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back.

{observation_table}

## Rewards
The attacker's reward with the opposite sign. The defender loses the increase of the damage D (5.8), and
`formation_weight_mps2` times the increase of the formation cost. The undiscounted return equals
`-(info["damage"] + info["formation_charge"])`.

The formation cost is the time integral of the mean of two errors: the intact vehicles' mean speed error (over v_ref)
and their mean separation error (over 10 sigma), each limited to 1. With `formation_cost="log_place"` it is the time
integral of log(1 + d). Here d is the vehicles' mean distance in sigma from their places behind the reference. The
seized vehicle does not count from the onset on. With `"open_place"` (`learning`) no vehicle has a place beyond the
seized one either, since none can pass it. Without a cost (`paper`), driving apart wins at once.

## Starting State
Steady state: separations of 9 m, 25 m/s, the leader on its reference. Preset `learning` perturbs it. It also draws the
number of vehicles, which one is seized, the power ratio, drive, drag and the reference speed. Finally it draws
whether there is an attack, and when it begins.

## Episode End
Terminated after 100 s (`paper`, `oscillation`, `seats`) or 60 s, never before.

## Arguments
`preset` ("paper", "oscillation", "seats", "easy", "learning", "city"), `opponent` (an attacker: name,
"module:attribute" or policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.rogue.config.RogueConfig`:

{parameter_table}

## References
Dissertation, chapter 5: equations (5.1) to (5.15), Table 5.1, Figs. 5.1 to 5.11.

## Version History
* v0: first version.
"""

RHYTHM = "every 0.1 s"  # of the parallel form
SWARM = """\
The defence by one agent for each vehicle, through the adapter `give_way_vehicle`: it says whether the others give way
to its vehicle. In presets without accelerations beside controllers name `adapter="vehicle"` or `"vehicle_full"`."""
