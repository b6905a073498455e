"""The study of ERJ's joints: every choice measured over the workspace and along demonstrations."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from er_il.arms.arm import Arm
from er_il.datasets.joint_paths import JointPath
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import kinematics_of
from er_il.report.joints import notes
from er_il.spaces.joint_choice import (
    ANGLE_ERROR,
    FLIP,
    LENGTH,
    POSITION_ERROR,
    SEED_ERROR,
    along_demos,
    choices,
    over_workspace,
    ranked,
    sensitivity,
    singular_intervals,
)
from er_il.spaces.round_trip import EXACT, SINGULAR
from er_il.support.workers import run_jobs

Demos = Mapping[str, Sequence[JointPath]]  # by task or dataset

WORKSPACE = 1000  # configurations, uniform within the joint limits
WORKSPACE_SEED = 0
FEW_JOBS = 14  # no more are done sooner than worker processes start

SETTINGS = {
    "length_m": LENGTH,
    "singular": SINGULAR,
    "exact_rad": EXACT,
    "flip_rad": FLIP,
    "seed_error_rad": SEED_ERROR,
    "playback_error_m": POSITION_ERROR,
    "playback_error_rad": ANGLE_ERROR,
    "workspace_seed": WORKSPACE_SEED,
}


def study_joints(arm: Arm, demos: Demos, workers: int, advance: Callable[[int, int], object]) -> dict[str, Any]:
    """Measure every choice of n-6 joints; return everything as JSON.

    Args:
        arm: The arm.
        demos: Demonstrations, if any: by them the choices are ranked, else by the workspace.
        workers: Number of worker processes, if there is much to measure.
        advance: Called with the number of measurements done, and their total.

    Raises:
        ArmError: the arm has no redundancy.
    """
    every = choices(arm)
    q = np.random.default_rng(WORKSPACE_SEED).uniform(arm.lower, arm.upper, (WORKSPACE, arm.dof))
    paths = [[path.commanded for path in of_set] for of_set in demos.values()]
    jobs = [(over_workspace, arm, choice, q) for choice in every]
    jobs += [(along_demos, arm, choice, of_set) for of_set in paths for choice in every]
    measured = run_jobs(jobs, workers if len(jobs) > FEW_JOBS else 1, advance)
    workspace, *of_demos = itertools.batched(measured, len(every))
    ranking = ranked(of_demos or [workspace])
    recommended = JointAngle(arm, ranking[0])
    twisting = kinematics_of(arm).twisting.tolist()
    report = {
        "arm": arm.name,
        "joints": list(arm.joints),
        "twisting": [joint for joint, twists in zip(arm.joints, twisting, strict=True) if twists],
        "default": list(arm.redundant),
        "recommended": list(ranking[0]),
        "ranking": [list(choice) for choice in ranking],
        "workspace": [vars(fitness) for fitness in workspace],
        "demos": {name: [vars(each) for each in of_set] for name, of_set in zip(demos, of_demos, strict=True)},
        "near_singularity": [
            {"demos": name, "episode": path.episode} | vars(interval)
            for name, of_set in demos.items()
            for path in of_set
            for interval in singular_intervals(sensitivity(recommended, path.commanded).smallest)
        ],
        "settings": SETTINGS,
    }
    return report | {"notes": notes(report)}
