"""The constants of each episode as one structured array, which numba kernels read by field name."""

from __future__ import annotations

import numpy as np

PARAMETERS = np.dtype(
    [
        ("num_vehicles", np.int64),  # M of this episode; vehicles q >= num_vehicles of the arrays are absent
        ("vehicles_per_platoon", np.int64),  # n
        ("dt_s", np.float64),  # integration step
        ("tau_s", np.float64),  # actuation lag, (2.1)
        ("desired_gap_m", np.float64),  # x_d
        ("headway_s", np.float64),  # h of the platoon leaders, (2.4)
        ("proportional_gain", np.float64),  # k_p, 1/s2
        ("derivative_gain", np.float64),  # k_d, 1/s
        ("desired_speed_mps", np.float64),  # v_d
        ("min_speed_mps", np.float64),  # v_min
        ("max_speed_mps", np.float64),  # v_max
        ("min_acceleration_mps2", np.float64),  # u_min
        ("max_acceleration_mps2", np.float64),  # u_max
        ("standstill_gap_m", np.float64),  # r_0
        ("exact_integration", np.bool_),  # zero-order hold of (2.1) instead of explicit Euler
        ("saturate_command", np.bool_),  # clip the commands of intact and human vehicles to [u_min, u_max]
        ("one_sided_avoidance", np.bool_),  # (2.6) with max(0, v^2 - v_p^2)
        ("transitional_controller", np.bool_),  # leaders brake early when they close in (interpretation S1)
        ("inelastic_contact", np.bool_),  # vehicles that touch stay behind one another instead of passing as ghosts
        ("stop_at_collision", np.bool_),  # the episode stands still from the first collision of an intact vehicle on
    ],
    align=True,
)
