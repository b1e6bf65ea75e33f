"""Three readings of what the paper leaves open: integration step, integrator, saturation and contact."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Interpretation:
    """What a simulation of chapter 2 must assume although the paper does not print it.

    The step is part of the model, not an accuracy setting: crash flags of Table 2.2 flip between 0.01 s and 0.02 s.
    The flags have the names and meanings of the fields of `parameters.PARAMETERS`.
    """

    dt_s: float  # integration step; inferred, only 0.01 to 0.02 s fits the paper's numbers
    exact_integration: bool = False  # zero-order hold of (2.1) instead of explicit Euler
    saturate_command: bool = False  # clip every command to [u_min, u_max]; without it the command leads the lag
    one_sided_avoidance: bool = False  # (2.6) with max(0, v^2 - v_p^2)
    transitional_controller: bool = False  # leaders that close in brake before they reach h v
    inelastic_contact: bool = False  # vehicles that touch stay behind one another instead of passing as ghosts


INTERPRETATIONS = {
    # The plain reading; the default.
    "S0": Interpretation(dt_s=0.01),
    # All six crash flags of the baseline of Table 2.2 are right.
    "S1": Interpretation(dt_s=0.02, transitional_controller=True),
    # All six E_v of the baseline of Table 2.2 are within two points.
    "S2": Interpretation(
        dt_s=0.05, exact_integration=True, saturate_command=True, one_sided_avoidance=True, inelastic_contact=True
    ),
}
