"""The documentation pages of the environments: what false data injection shows to whoever plays it."""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | the readings of its sensors, in whole steps | which readings are used, and small corrections |
| sees | true gaps and speeds; in `learning` the filter's prediction | reported and expected readings, last commands |
| knows | which sensors are attacked, from when on, whether at all | none of this |
| is charged for | in `learning` a lie that is rejected is wasted | replaced readings and corrections, a little |
"""

ATTACK = """\
Make two vehicles of a platoon collide by adding to what their sensors report.

## Description
n = 4 vehicles keep gaps of 5 m at constant speed. Each vehicle follows its front sensors, which measure the distance
ahead (range) and how fast it changes (range-rate). It also looks back at its follower. The attacker adds an injection
to each attacked reading: a whole multiple of the sensor's resolution. Commands must stay within their limits, and
readings must stay possible. Vehicle 1 is the last. Vehicle n leads and follows a virtual reference.

Preset `learning` is a duel with a defender that has a filter. All readings are noisy and rounded to the resolution,
also those of the rear sensors. Disturbances last for 1 s, and a lie can hide in them. Each vehicle's change at times
of their own, unknown to both sides. The attacker sees the true errors and the filter's prediction. It also knows from
when on injections work. In a quarter of the episodes they never do. An injection is added to the readings of the next
step.

## Threat Model
{threats}
## Action Space
`MultiDiscrete`, every 0.2 s, one entry per attacked sensor: first the ranges by vehicle, then the range-rates. Where
tasks are drawn there is one entry per sensor of the platoon. Entry a of a range sensor injects (a - 100) 0.5 m, with
201 levels. Entry a of a range-rate sensor injects (a - 40) 0.25 m/s, with 81 levels.

`info["action_mask"]` and `action_masks()` tell what is legal now, (3.48) to (3.50). They judge each sensor alone, and
suppose that the other attacked sensors help. A legal move can lead to a state without a legal move, a dead end. The
mask then offers "no injection", which also ends the episode.

In preset `learning` the attacker chooses every 0.1 s one of 41 levels for each of 14 sensors. Entry a then injects
(a - 20) 0.5 m or (a - 20) 0.25 m/s.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.
Where tasks are drawn, the observation also names the attacked sensors and the target. With a filter it adds the
filter's prediction, the deviations that the filter expects, `wait` (steps before an injection works), and which
readings the defender used.

{observation_table}

## Rewards
Zero until the end. Then the reward is the closing speed of the target pair in m/s, if that pair collides. With
`paid_pair="any"` the fastest colliding pair counts.

With `goal="instability"` the reward of a step is how much the errors of the target pair have grown, in m (`"any"`: of
all pairs). The error is the root of e_x^2 + e_v^2, which is (3.20) with P = 1. The attacker also gains what an active
defender is charged for replaced readings and corrections, with either goal.

The undiscounted return equals `info["impact_speed_mps"] + info["alarm_cost_mps"] + info["correction_cost_mps"]`. With
`goal="instability"`, `info["error_growth_m"]` replaces the first term. While `info["bound_valid"]` is 1,
`info["oracle_bound_mps"]` is a certified upper bound of the return. A known plan attains `info["oracle_value_mps"]`.

## Starting State
Steady state. Presets `defense`, `drawn` and `learning` perturb it. With `tasks`, each reset draws the attacked sensors
and the target. `tasks="single"`, `"pairs"` or `"feasible"` draws from the tasks that the shipped oracle knows to be
feasible. A list such as `"x4>4 v1,3>2"` names the tasks to draw from.

## Episode End
Terminated at the first sample where any gap has closed. With `limits="hard"` an illegal injection also terminates the
episode; with `limits="clip"` injections and commands are clipped instead. Terminated after `horizon` steps at the
latest.

## Arguments
`preset` ("paper": set A of the specification, "easy": feasible tasks drawn, "defense", "drawn": starts and gains drawn
too, "learning": the duel), `opponent` (a defender: name, "module:attribute" or policy), `render_mode`,
`frame_skip` (decisions that an action is held for), and any field of `cps_envs.fdi.config.FdiConfig`:

{parameter_table}

## References
Dissertation, chapter 3 and appendix B: equations (3.3) to (3.55), Tables 3.1 to 3.7. The chapter does not state the
gains, limits, sampling time and horizons. We chose those here, and other values fit its tables as well.

## Version History
* v0: first version.
"""

DEFENSE = """\
Decide which sensor readings of a platoon to believe, so that falsified ones cause no collision.

## Description
The other side of `FdiAttack`. It is an extension: the paper has no defender. The defender sees what the sensors
reported in the last step, what a model of the platoon expected, and the commands. It never sees the true errors.
Preset `defense` adds disturbances that the model does not know. A defender that believes only the model therefore
drifts away from the truth.

In preset `learning` a Kalman filter predicts the readings of all front and rear sensors. Its estimate replaces what
the defender does not trust. The defender judges readings before the vehicles use them. It does not know whether there
is an attack, when it begins, or which sensors lie. Honest readings are noisy, and disturbances last for 1 s.

## Threat Model
{threats}
## Action Space
`MultiDiscrete`, every step, decided on the readings of the step before. The first 2n entries are about readings:
ranges of vehicles 1..n, then range-rates. 1 uses the reading, 0 replaces it. The replacement of a range is the rear
sensor of the vehicle ahead. Of the lead, and of a range-rate, it is the model's prediction, which leaves out the
readings that are not trusted now. The last n entries correct each vehicle's acceleration in steps of 0.5 m/s2
(4 = none).

In preset `learning` there are 14 readings, and the decision is about the present ones. They are the ranges at the
fronts of vehicles 1..4 and at the rears of 2..4, then the range-rates.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back.

{observation_table}

## Rewards
The attacker's reward with the opposite sign. The defender loses the impact speed at the end; in preset `defense` that
of any pair. With `goal="instability"` it loses the growth of the target pair's errors instead. It also loses 0.01 m/s
per second for each replaced reading, and 0.01 times the mean size of its corrections over time.

## Starting State
Steady state. Presets `defense` and `learning` perturb it, and draw the opponent's attacked sensors and target.
`learning` also draws gains, disturbances, whether there is an attack, and when it begins.

## Episode End
Terminated at the first sample where any gap has closed. With `limits="hard"` the attacker's illegal injection also
terminates the episode. Terminated after `horizon` steps at the latest.

## Arguments
`preset` ("paper", "easy", "defense", "drawn", "learning"), `opponent` (an attacker: name, "module:attribute" or
policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.fdi.config.FdiConfig`:

{parameter_table}

## References
Dissertation, chapter 3, for the platoon and the attacks. The defence goes beyond it.

## Version History
* v0: first version.
"""

RHYTHM = "at every step"  # of the parallel form

SWARM = "The defence with one agent per distance sensor, which says whom it believes. Take preset `learning`."
