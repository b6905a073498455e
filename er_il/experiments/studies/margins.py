"""The study of margins: how far demonstrations stay from the folds of ERJ, ERA and ERX."""

from collections.abc import Sequence
from typing import Any

from er_il.arms.arm import Arm, Weights
from er_il.experiments.studies import Advance, Demos
from er_il.report.margins import FITTED, PRESET, notes
from er_il.spaces.base import Array
from er_il.spaces.demo_margins import margins_along, motion_measured
from er_il.spaces.joint_choice import choices
from er_il.spaces.margin import demonstrated_weights, home_weights
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import AND, AT, ERA, ERA_STEREO, ERJ, erx_name, make_arm_space
from er_il.support.workers import run_jobs


def study_margins(arm: Arm, demos: Demos, workers: int, advance: Advance) -> dict[str, Any]:
    """Measure the margins of every choice of ERJ's joints, ERA and ERX along demonstrations; return all as JSON.

    ERX is measured with the arm's own weights and with weights fitted to each set of demonstrations.

    Raises:
        ArmError: the arm has no redundancy.
    """
    every = choices(arm)
    own = arm.weights or home_weights(arm)
    paths = {name: [path.commanded for path in of_set] for name, of_set in demos.items()}
    fitted = {name: demonstrated_weights(arm, of_set) for name, of_set in paths.items()}
    spaces = {name: _spaces(arm, every, {PRESET: own, FITTED: fitted[name]}) for name in paths}
    jobs = [(_measure, arm, space, paths[name]) for name, of_set in spaces.items() for space in of_set.values()]
    measured = iter(run_jobs(jobs, workers, advance))
    rows = [
        {"demos": name, "space": label, "name": space}
        | (row := vars(next(measured)))
        | {"episode": demos[name][row["demo"]].episode}
        for name, of_set in spaces.items()
        for label, space in of_set.items()
    ]
    report = {
        "arm": arm.name,
        "joints": list(arm.joints),
        "margins": rows,
        "coordinates": [
            {"demos": name, "weights": [list(row) for row in each]} | motion_measured(arm, each)
            for name, each in [(None, own), *fitted.items()]  # None: the arm's own
        ],
    }
    return report | {"notes": notes(report)}


def _spaces(arm: Arm, every: Sequence[tuple[str, ...]], weights: dict[str, Weights]) -> dict[str, str]:
    """Names of the spaces by their labels."""
    found = {AND.join(choice): ERJ + AT + AND.join(choice) for choice in every}
    if arm.redundancy == 1 and arm.angle_frames is not None:
        found |= {ERA: ERA, ERA_STEREO: ERA_STEREO}
    return found | {label: erx_name(each) for label, each in weights.items()}


def _measure(arm: Arm, name: str, demos: Sequence[Array]) -> Any:
    space = make_arm_space(name, arm)
    assert isinstance(space, PoseSpace)
    return margins_along(space, demos)
