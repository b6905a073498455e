"""The study of ERJ's joints: every choice measured over the workspace and along demonstrations, and what follows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from er_il.arms.arm import Arm
from er_il.datasets.joint_path import JointPath
from er_il.experiments.studies.joint_notes import notes
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.joint_choice import (
    ANGLE_ERROR,
    FLIP,
    LENGTH,
    POSITION_ERROR,
    SEED_ERROR,
    Choice,
    Fitness,
    along_demos,
    choices,
    over_workspace,
    ranked,
    sensitivities,
    stretches,
)
from er_il.spaces.round_trip import EXACT, SINGULAR
from er_il.support.workers import run_jobs

Demos = Mapping[str, Sequence[JointPath]]  # by task or dataset

WORKSPACE = 1000  # configurations, uniform within the joint limits
WORKSPACE_SEED = 0
FEW_JOBS = 14  # no more are done sooner than worker processes start


@dataclass(frozen=True)
class Stretch:
    """Consecutive steps of a demonstration near a singularity of the recommended choice."""

    demos: str
    episode: int
    first: int
    last: int
    smallest: float  # singular value


@dataclass(frozen=True)
class JointStudy:
    """What every choice of joints does on one arm."""

    arm: Arm
    workspace: dict[Choice, Fitness]
    demos: dict[str, dict[Choice, Fitness]]
    near: tuple[Stretch, ...]

    @property
    def ranking(self) -> list[Choice]:
        """Choices from the best to the worst: along the demonstrations if there are any, else over the workspace."""
        return ranking(self.workspace, self.demos)

    def report(self) -> dict[str, Any]:
        """Everything as JSON."""
        twisting = kinematics_of(self.arm).twisting.tolist()
        report = {
            "arm": self.arm.name,
            "joints": list(self.arm.joints),
            "twisting": [joint for joint, twists in zip(self.arm.joints, twisting, strict=True) if twists],
            "default": list(self.arm.redundant),
            "recommended": list(self.ranking[0]),
            "ranking": [list(choice) for choice in self.ranking],
            "workspace": [asdict(fitness) for fitness in self.workspace.values()],
            "demos": {name: [asdict(each) for each in of_set.values()] for name, of_set in self.demos.items()},
            "near_singularity": [asdict(stretch) for stretch in self.near],
            "settings": {
                "length_m": LENGTH,
                "singular": SINGULAR,
                "exact_rad": EXACT,
                "flip_rad": FLIP,
                "seed_error_rad": SEED_ERROR,
                "playback_error_m": POSITION_ERROR,
                "playback_error_rad": ANGLE_ERROR,
                "workspace_seed": WORKSPACE_SEED,
            },
        }
        return report | {"notes": notes(report)}


def ranking(workspace: Mapping[Choice, Fitness], demos: Mapping[str, Mapping[Choice, Fitness]]) -> list[Choice]:
    """Choices from the best to the worst."""
    return ranked(list(demos.values()) or [workspace])


def study_joints(arm: Arm, demos: Demos, workers: int, advance: Callable[[int, int], object]) -> JointStudy:
    """Measure every choice of n-6 joints.

    Args:
        arm: The arm.
        demos: Demonstrations, if any.
        workers: Number of worker processes, if there is much to measure.
        advance: Called with the number of measurements done, and their total.

    Raises:
        ArmError: the arm has no redundancy.
    """
    every = choices(arm)
    q = np.random.default_rng(WORKSPACE_SEED).uniform(arm.lower, arm.upper, (WORKSPACE, arm.dof))
    paths = {name: [path.commanded for path in of_set] for name, of_set in demos.items()}
    over = sensitivities(arm, q)
    along = {name: [sensitivities(arm, path) for path in of_set] for name, of_set in paths.items()}
    jobs = [(over_workspace, arm, choice, q, over[choice]) for choice in every]
    for name, of_set in paths.items():
        jobs += [(along_demos, arm, choice, of_set, [each[choice] for each in along[name]]) for choice in every]
    measured = run_jobs(jobs, workers if len(jobs) > FEW_JOBS else 1, advance)
    sets = [dict(zip(every, measured[i : i + len(every)], strict=True)) for i in range(0, len(measured), len(every))]
    workspace, of_demos = sets[0], dict(zip(demos, sets[1:], strict=True))
    best = ranking(workspace, of_demos)[0]
    near = [
        Stretch(name, path.episode, *stretch)
        for name, of_set in demos.items()
        for path, sensitivity in zip(of_set, along[name], strict=True)
        for stretch in stretches(sensitivity[best].smallest)
    ]
    return JointStudy(arm, workspace, of_demos, tuple(near))
