"""Fig. 3.2: the runs behind it, under several readings of what the paper leaves open or prints wrongly."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cps_baselines.fdi.branch_and_bound import CORRECTED, PRINTED
from cps_baselines.fdi.reproduction.course import Course, attack_course
from cps_baselines.paper.collisions import CollisionRun, collision_runs
from cps_envs.fdi.config import FIG_3_2, FdiConfig

LEAD = FIG_3_2.num_vehicles
LONG = replace(FIG_3_2, proportional_gain=1.0, dt_s=0.1, horizon=FIG_3_2.horizon // 2)


@dataclass(frozen=True)
class Variant:
    """One way to run Fig. 3.2."""

    name: str
    meaning: str
    config: FdiConfig = FIG_3_2
    gap_sign: float = CORRECTED
    ignored_pair: int | None = None  # may collide without ending the run


VARIANTS = (
    Variant("fig32", "the preset, k_p 2, k_d 3, dt 0.05 s"),
    Variant("k_d 5", "the same with k_d 5", replace(FIG_3_2, derivative_gain=5.0)),
    Variant("k_p 1", "k_p 1, k_d 3, dt 0.1 s", LONG),
    Variant("9-10 only", "the preset, where pair 10-11 may overlap", ignored_pair=LEAD),
    Variant("+e_x", "the preset with the sign of e_x in (3.39) as printed", gap_sign=PRINTED),
    Variant("bounded", "the preset with readings of 0 m or more, step 6", replace(FIG_3_2, limit_readings=True)),
)


@dataclass(frozen=True)
class FigureRun:
    """One run of a variant, an experiment of the chapter."""

    variant: Variant
    kind: str  # sensors of the lead vehicle that are attacked: "x" or "xv"

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return 0.1

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"Fig. 3.2, {self.kind}{LEAD}, {self.variant.name}"

    @property
    def paper(self) -> CollisionRun:
        """What the text says about this attack."""
        (run,) = (run for run in collision_runs() if str(run.sensors) == f"{self.kind}{LEAD}")
        return run

    def run(self) -> Course:
        """Run it for up to 60 s."""
        variant = self.variant
        return attack_course(
            variant.config, LEAD, self.kind, gap_sign=variant.gap_sign, ignored_pair=variant.ignored_pair
        )


def figure_runs() -> list[FigureRun]:
    """Every variant with the range sensor attacked, and with both sensors."""
    return [FigureRun(variant, kind) for variant in VARIANTS for kind in ("x", "xv")]
