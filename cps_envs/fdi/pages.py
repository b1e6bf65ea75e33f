"""The documentation pages of the environments: what false data injection shows to whoever plays it."""

STORY = """\
Every car of a platoon measures its distance to the next one, and how fast that distance changes. The attacker has
taken over a few of these sensors. It adds small lies to what they report, and wants two cars to hit each other as
hard as possible. A lie has to be possible: readings and commands stay within their limits. In the duel a filter
watches the readings, so that a lie also has to look like noise. The defender decides which readings to believe.
"""

THREATS = """\
| | attacker | defender |
|---|---|---|
| touches | the readings of its sensors, in whole steps | which readings are used, and small corrections |
| sees | true gaps and speeds; in `learning` the filter's prediction | reported and expected readings, last commands |
| knows | which sensors are attacked, from when on, whether at all | none of this |
| pays for | in `learning` a lie that is rejected is wasted | small charges for replaced readings and corrections |
"""

ATTACK = """\
Make two vehicles of a platoon collide by adding to what their sensors report.

## Story
{story}
## Description
n = 4 vehicles keep gaps of 5 m at constant speed; each follows its front range and range-rate sensors and looks
back at its follower. The attacker adds whole multiples of the sensor's resolution to the readings of the attacked
sensors, as long as commands stay within the limits and readings stay possible. It wants the target vehicle to hit
the one ahead as fast as it can. Vehicle 1 is the last, vehicle n the lead, which follows a virtual reference.

Preset `learning` is a duel with a defender that has a filter. Every reading is noisy and rounded to the resolution,
those of the rear sensors too. Disturbances last for 1 s, and a lie can hide in them. The attacker sees the true errors
and the filter's prediction, and knows from when on injections work; in a quarter of the episodes they never do. An
injection is added to the readings of the next step.

## Threat Model
{threats}
## Action Space
`MultiDiscrete`, every 0.2 s, one entry per attacked sensor (ranges by vehicle, then range-rates), or one per sensor
of the platoon where tasks are drawn. Entry a of a range sensor injects (a - 100) 0.5 m (201 levels), of a
range-rate sensor (a - 40) 0.25 m/s (81 levels). `info["action_mask"]` and `action_masks()` tell what is legal now,
(3.48) to (3.50), per sensor and supposing that the other attacked sensors help. A legal move can lead to a state
without one (a dead end): the mask then offers "no injection", which ends the episode too. `mask="look_ahead"` also
keeps the commands of the vehicles that are not attacked legal one step later; it avoids many dead ends, not all.
With `attack_action="share"` an entry is 0 = inject nothing, 1 to 21 = from the lowest to the highest legal level.
In preset `learning`: every 0.1 s, one of 41 levels for each of 14 sensors; (a - 20) 0.5 m or (a - 20) 0.25 m/s.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["attacker"].decode(observation)` gives units back.
Where tasks are drawn, the attacked sensors and the target are observed too; with a filter also its prediction, the
deviations that it expects, `wait` (steps before an injection works) and which readings the defender used.

{observation_table}

## Rewards
Zero until the end; then the closing speed in m/s of the target pair if it collides (`paid_pair="any"`: of the
fastest colliding pair). With `goal="instability"` every step pays what the errors of the target pair (`"any"`: of all
pairs) have grown in it, in m: the root of e_x^2 + e_v^2, which is (3.20) with P = 1. An active defender's charges for
replaced readings and corrections are the attacker's gain.
The undiscounted return equals `info["impact_speed_mps"] + info["alarm_cost_mps"] + info["correction_cost_mps"]`, or
with `info["error_growth_m"]` in place of the first.
`info["oracle_bound_mps"]` is a certified upper bound of it while `info["bound_valid"]` is 1, and
`info["oracle_value_mps"]` what a known plan attains.

## Starting State
Steady state; perturbed in presets `defense`, `drawn` and `learning`. With `tasks` each reset draws the attacked
sensors and the target: `tasks="single"`, `"pairs"` or `"feasible"` from those that the shipped oracle knows to be
feasible, or a list such as `"x4>4 v1,3>2"`.

## Episode End
Terminated at the first sample where any gap has closed, and at an illegal injection (`limits="hard"`; with
`limits="clip"` injections and commands are clipped instead). Truncated after `horizon` steps.

## Arguments
`preset` ("paper": set A of the specification, "B", "C", "fig32", "clip", "easy": feasible tasks drawn, "five": the
same with five vehicles, "instability": the goal of section 3.3, "defense", "drawn": starts and gains drawn too,
"learning": the duel), `opponent` (a defender: name, "module:attribute" or
policy), `render_mode`, `frame_skip` (decisions that an action is held for), and any field of
`cps_envs.fdi.config.FdiConfig`:

{parameter_table}

## References
Dissertation, chapter 3 and appendix B: equations (3.3) to (3.55), Tables 3.1 to 3.7. The chapter does not state the
gains, limits, sampling time and horizons; those here are chosen, and others fit its tables as well.

## Version History
* v0: first version.
"""

DEFENSE = """\
Decide which sensor readings of a platoon to believe, so that falsified ones cause no collision.

## Story
{story}
## Description
The other side of `FdiAttack`, an extension: the paper has no defender. It sees what the sensors reported in the
last step, what a model of the platoon expected, and the commands; never the true errors. Preset `defense` adds
disturbances that the model does not know, so that believing the model alone drifts away from the truth.

In preset `learning` a Kalman filter predicts the readings of all front and rear sensors, and its estimate replaces what
the defender does not trust. The defender judges readings before the vehicles use them. It does not know whether there
is an attack, when it begins, and which sensors lie; honest readings are noisy, and disturbances last for 1 s.

## Threat Model
{threats}
## Action Space
`MultiDiscrete`, every step: first 2n entries, 1 = use the reading, 0 = replace it (ranges of vehicles 1..n, then
range-rates), by the rear sensor of the vehicle ahead where that is shared (`share_rear_range`), else by the model's
prediction, which leaves out the readings that are not trusted now. Then n entries: a correction of each vehicle's
acceleration in steps of 0.5 m/s2 (4 = none). Decided on the readings of the step before.
In preset `learning` there are 14 readings (ranges of the fronts of 1..4 and the rears of 2..4, then range-rates), and
the decision is about the readings of now.

## Observation Space
`Box(-1, 1, (size,), float32)`; `env.unwrapped.game.fields["defender"].decode(observation)` gives units back.

{observation_table}

## Rewards
Minus the attacker's: minus the impact speed at the end (preset `defense`: of any pair; preset `instability`: minus
what the errors of the target pair have grown), minus 0.01 m/s per second
and replaced reading, minus 0.01 times the corrections' mean size over time.

## Starting State
Steady state; perturbed in presets `defense` and `learning`, which also draw the attacked sensors and target of its
opponent. `learning` draws gains, disturbances and the beginning of the attack, if there is one.

## Episode End
Terminated at the first sample where any gap has closed, or when the attacker's injection is illegal with
`limits="hard"`. Truncated after `horizon` steps.

## Arguments
`preset` ("paper", "B", "C", "fig32", "clip", "easy", "five", "instability", "defense", "drawn", "learning"),
`opponent` (an attacker: name, "module:attribute" or policy), `render_mode`, `frame_skip` (decisions that an action is
held for), and any field of `cps_envs.fdi.config.FdiConfig`:

{parameter_table}

## References
Dissertation, chapter 3: the platoon and the attacks; the defence goes beyond it.

## Version History
* v0: first version.
"""

RHYTHM = "both at every step"  # of the parallel form
