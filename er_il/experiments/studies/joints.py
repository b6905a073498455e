"""The study of ERJ's joints: every choice measured over the workspace and along demonstrations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from er_il.arms.arm import Arm
from er_il.datasets.joint_path import JointPath
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
    sensitivities,
    stretches,
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


@dataclass(frozen=True)
class SingularInterval:
    """Consecutive steps of a demonstration near a singularity of the recommended choice."""

    demos: str
    episode: int
    first: int
    last: int
    smallest: float  # singular value


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
    paths = {name: [path.commanded for path in of_set] for name, of_set in demos.items()}
    over = sensitivities(arm, q)
    along = {name: [sensitivities(arm, path) for path in of_set] for name, of_set in paths.items()}
    jobs = [(over_workspace, arm, choice, q, over[choice]) for choice in every]
    for name, of_set in paths.items():
        jobs += [(along_demos, arm, choice, of_set, [each[choice] for each in along[name]]) for choice in every]
    measured = run_jobs(jobs, workers if len(jobs) > FEW_JOBS else 1, advance)
    sets = [dict(zip(every, measured[i : i + len(every)], strict=True)) for i in range(0, len(measured), len(every))]
    workspace, of_demos = sets[0], dict(zip(demos, sets[1:], strict=True))
    ranking = ranked(list(of_demos.values()) or [workspace])
    near = [
        SingularInterval(name, path.episode, *interval)
        for name, of_set in demos.items()
        for path, sensitivity in zip(of_set, along[name], strict=True)
        for interval in stretches(sensitivity[ranking[0]].smallest)
    ]
    twisting = kinematics_of(arm).twisting.tolist()
    report = {
        "arm": arm.name,
        "joints": list(arm.joints),
        "twisting": [joint for joint, twists in zip(arm.joints, twisting, strict=True) if twists],
        "default": list(arm.redundant),
        "recommended": list(ranking[0]),
        "ranking": [list(choice) for choice in ranking],
        "workspace": [asdict(fitness) for fitness in workspace.values()],
        "demos": {name: [asdict(each) for each in of_set.values()] for name, of_set in of_demos.items()},
        "near_singularity": [asdict(interval) for interval in near],
        "settings": SETTINGS,
    }
    return report | {"notes": notes(report)}
