"""The study of ERJ's joints: every choice measured over the workspace and along demonstrations."""

import itertools
from typing import Any

import numpy as np

from er_il.arms.arm import Arm
from er_il.experiments.studies import Advance, Demos
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import kinematics_of
from er_il.report.joints import notes
from er_il.spaces import joint_choice, round_trip
from er_il.spaces.joint_choice import sensitivity, singular_intervals
from er_il.support.workers import run_jobs

WORKSPACE = 1000  # configurations, uniform within the joint limits
WORKSPACE_SEED = 0
FEW_JOBS = 14  # no more are done sooner than worker processes start


def study_joints(arm: Arm, demos: Demos, workers: int, advance: Advance) -> dict[str, Any]:
    """Measure every choice of n-6 joints; return everything as JSON.

    Args:
        arm: The arm.
        demos: Demonstrations, if any: by them the choices are ranked, else by the workspace.
        workers: Number of worker processes, if there is much to measure.

    Raises:
        ArmError: the arm has no redundancy.
    """
    every = joint_choice.choices(arm)
    q = np.random.default_rng(WORKSPACE_SEED).uniform(arm.lower, arm.upper, (WORKSPACE, arm.dof))
    paths = [[path.commanded for path in of_set] for of_set in demos.values()]
    jobs = [(joint_choice.over_workspace, arm, choice, q) for choice in every]
    jobs += [(joint_choice.along_demos, arm, choice, of_set) for of_set in paths for choice in every]
    measured = run_jobs(jobs, workers if len(jobs) > FEW_JOBS else 1, advance)
    workspace, *of_demos = itertools.batched(measured, len(every))
    ranking = joint_choice.ranked(of_demos or [workspace])
    recommended = JointAngle(arm, ranking[0])
    report = {
        "arm": arm.name,
        "joints": list(arm.joints),
        "twisting": list(itertools.compress(arm.joints, kinematics_of(arm).twisting)),
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
        "settings": {
            "length_m": joint_choice.LENGTH,
            "singular": round_trip.SINGULAR,
            "exact_rad": round_trip.EXACT,
            "flip_rad": joint_choice.FLIP,
            "seed_error_rad": joint_choice.SEED_ERROR,
            "playback_error_m": joint_choice.POSITION_ERROR,
            "playback_error_rad": joint_choice.ANGLE_ERROR,
            "workspace_seed": WORKSPACE_SEED,
        },
    }
    return report | {"notes": notes(report)}
