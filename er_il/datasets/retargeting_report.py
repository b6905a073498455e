"""The report of a retargeted dataset: what could not be reached, by how much, and which limits were in the way."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from er_il.arms.arm import Arm
from er_il.datasets.dataset import Dataset
from er_il.datasets.decoding import read_encoded_episodes
from er_il.datasets.joint_paths import joint_vectors
from er_il.datasets.retargeted import COMMANDED, Retargeted, RetargetedArm
from er_il.spaces.base import Array
from er_il.spaces.deviation import Deviation
from er_il.spaces.retargeting import Retargeting
from er_il.support.errors import DatasetError
from er_il.support.series import stretches
from er_il.support.workers import cores

COUNTED, ERRORS = ("off_elbow", "off_pose", "too_fast"), ("position", "rotation", "arm_angle")  # of a Deviation


def retargeting_report(retargeted: Retargeted) -> dict[str, Any]:
    """What became of each arm's paths, and of those of each episode that are not as asked for, as JSON."""
    arms: dict[str, Any] = {}
    episodes: dict[int, Any] = {}
    for arm in retargeted.arms:
        arms[arm.name] = arm.origin() | {
            what: _summary(each, arm.new.space.arm) for what, each in arm.deviations.items()
        }
        for what, deviations in arm.deviations.items():
            for number, each in zip(retargeted.source.episodes, deviations, strict=True):
                if each.missed.any() or each.too_fast.any():
                    found = _summary([each], arm.new.space.arm) | {"intervals": stretches(each.missed)}
                    episodes.setdefault(number, {}).setdefault(arm.name, {})[what] = found
    frames, count = retargeted.source.frames, retargeted.source.count
    return {"frames": frames, "episodes": count, "arms": arms, "by_episode": dict(sorted(episodes.items()))}


def _summary(deviations: Sequence[Deviation], arm: Arm) -> dict[str, Any]:
    """Frames by what became of them, the largest deviations, and what was in the way.

    That are, where a frame is missed, the joints at their limits; no joint is where the arm is stretched, too short.
    """
    limits = np.sum([each.at_limit[each.missed].sum(axis=0) for each in deviations], axis=0)
    speeds = np.max([each.speed.max(axis=0) for each in deviations], axis=0)
    counted = {what: int(sum(getattr(each, what).sum() for each in deviations)) for what in COUNTED}
    largest = {f"{what}_error": float(max(getattr(each, what).max() for each in deviations)) for what in ERRORS}
    return {
        "frames": sum(len(each.position) for each in deviations),
        **counted,
        **largest,
        "stretched": int(sum((each.off_pose & ~each.at_limit.any(axis=1)).sum() for each in deviations)),
        "limits": {joint: int(count) for joint, count in zip(arm.joints, limits, strict=True) if count},
        "speeds": {joint: float(ratio) for joint, ratio in zip(arm.joints, speeds, strict=True) if ratio > 1.0},
    }


def compare_with(original: Dataset, retargeted: Retargeted) -> dict[str, Any]:
    """How far a dataset that was retargeted to another arm and back is from the original, as JSON.

    Frames that either way could not reach exactly are left out, and counted.

    Args:
        original: The dataset before both, which says which arms it is of.
        retargeted: The way back.

    Raises:
        DatasetError: it has other arms or frames.
    """
    layout = original.layout
    labels = {part.label: part for part in layout.parts}
    lengths = [rows.stop - rows.start for rows in original.episodes.values()]
    for arm in retargeted.arms:
        part = labels.get(arm.old.label)
        if part is None or part.space.arm.fingerprint != arm.new.space.arm.fingerprint:
            raise DatasetError(f"{original.root} is not of the arm {arm.new.space.arm.name}.")
    if lengths != [len(each) for each in retargeted.vectors]:
        raise DatasetError(f"{original.root} does not hold the same episodes.")
    episodes = read_encoded_episodes(original, layout, original.joints_column(layout))
    vectors = joint_vectors(layout, episodes, cores())
    return {
        arm.name: _compared([layout.angles(labels[arm.old.label], each) for each in vectors], arm, retargeted)
        for arm in retargeted.arms
    }


def _compared(originals: Sequence[Array], arm: RetargetedArm, retargeted: Retargeted) -> Mapping[str, Any]:
    way, back = Retargeting(arm.new.space.arm, arm.old.space.arm, 1 / arm.retargeting.scale), arm.retargeting
    same = Retargeting(back.target, back.target, 1.0)
    between = [retargeted.known.angles(arm.old, each) for each in retargeted.vectors]
    kept, found = [], []
    for q, middle, path, missed in zip(
        originals, between, arm.paths[COMMANDED], arm.deviations[COMMANDED], strict=True
    ):
        kept.append(~(way.deviation(way.goals(q), middle).missed | missed.missed))
        found.append(same.deviation(same.goals(q), path))
    exact = np.concatenate(kept)
    largest = {
        f"{name}_error": float(np.concatenate([getattr(each, name) for each in found])[exact].max(initial=0.0))
        for name in ERRORS
    }
    return {"frames": len(exact), "reached": int(exact.sum())} | largest
