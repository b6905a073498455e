"""A dataset of one robot as a dataset of joints of another, arm by arm (:mod:`er_il.spaces.retargeting`)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from er_il.datasets.assembled import Assembled
from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.decoding import read_encoded_episodes
from er_il.datasets.described import read_layout
from er_il.datasets.history import read_history
from er_il.datasets.hub import find_dataset
from er_il.datasets.integrity import check_whole
from er_il.datasets.joint_paths import joint_vectors
from er_il.datasets.new_arms import exchanged, new_parts
from er_il.datasets.number_checks import check_numbers
from er_il.datasets.record import RECORD
from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, STATE, action_feature, vector_feature
from er_il.datasets.wiring import Wiring
from er_il.kinematics.reach import reach, shoulder
from er_il.kinematics.rotation import Quaternion
from er_il.spaces.base import Array
from er_il.spaces.deviation import Deviation
from er_il.spaces.layout import Layout, Part
from er_il.spaces.pose import POSITION_NAMES, TASK
from er_il.spaces.registry import make_arm_space
from er_il.spaces.retargeting import Retargeting
from er_il.spaces.spec import ACTION
from er_il.support.atomic_files import atomic_folder, check_absent, check_outside, check_writable
from er_il.support.errors import DatasetError
from er_il.support.workers import cores

COMMANDED, MEASURED = "commanded", "measured"


@dataclass(frozen=True, eq=False)
class RetargetedArm:
    """One arm's motion as that of another; of each path an array an episode."""

    old: Part
    new: Part
    retargeting: Retargeting
    paths: dict[str, list[Array]]  # (T, n) [rad] commanded and, if it was, measured
    deviations: dict[str, list[Deviation]]  # of the same

    @property
    def name(self) -> str:
        """What reports call it."""
        return self.old.label or self.old.space.arm.name

    def origin(self) -> dict[str, Any]:
        """Which arm became which, and how, as JSON."""
        source, target = self.retargeting.source, self.retargeting.target
        return {
            "from": source.name,
            "to": target.name,
            "scale": self.retargeting.scale,
            "reach": [reach(source), reach(target)],
            "shoulder": [shoulder(source).tolist(), shoulder(target).tolist()],
            "arm_angle": self.retargeting.keeps_arm_angle,
        }


@dataclass(frozen=True, eq=False)
class Retargeted:
    """A dataset that was written."""

    source: Dataset
    known: Layout  # of the source's joint vector
    vectors: list[Array]  # (T, D) joint vectors of the source, by episode
    arms: tuple[RetargetedArm, ...]


def retarget(
    source: str,
    target: Path,
    to: Sequence[Wiring],
    *,
    scale: float | None = None,
    wirings: Sequence[Wiring] = (),
    repo_id: str = "",
    on_progress: Callable[[int, int], object] = lambda done, total: None,
) -> Retargeted:
    """Write a dataset again as one of another robot's joints.

    The action and the joints of the state become the other arm's; so do end-effector poses in the state that are named
    as er_il names them. All other dimensions and columns stay. A dataset of a simulated task forgets its task, whose
    world does not fit the other arm.

    Args:
        source: Folder, or repository id.
        target: Folder that does not exist.
        to: The new arms: one, or as many as the source has under the same labels.
        scale: Of positions about the shoulder; the ratio of the arms' reaches if omitted.
        wirings: The arms of a dataset that does not know them.
        repo_id: Where the target will be on the hub, for its card.
        on_progress: Called with the number of frames done, and their total.

    Raises:
        ErIlError: the dataset and the arms do not fit.
        FileExistsError: the target exists.
    """
    dataset = Dataset(find_dataset(source))
    check_whole(dataset)
    dataset, known = read_layout(dataset, wirings, "--from")
    if isinstance(dataset, Assembled):
        raise DatasetError(
            "The arms' joints are in other columns than action and observation.state. Put them together first: "
            f"er-il encode {source} --to joint --arms … --out OUT"
        )
    parts = new_parts(known, to)
    exchanges = [(part.motors.joints, parts[part.label].motors.joints) for part in known.parts]
    layout = Layout(exchanged(known.names, exchanges), tuple(parts.values()))
    check_absent(target)
    check_outside(target, dataset.root)
    check_writable(target)
    check_numbers(dataset, known)
    from lerobot.datasets.io_utils import load_info, write_info  # seconds of imports; mistakes are told before

    from er_il.datasets import card
    from er_il.datasets.rewriting import Column, rewrite

    read_history(dataset.root)  # raises if it is damaged
    episodes = read_encoded_episodes(dataset, known, dataset.joints_column(known))
    vectors = joint_vectors(known, episodes, cores())
    states = None if episodes[0].state is None else [np.asarray(each.state) for each in episodes]
    done = 0

    def advance(frames: int) -> None:
        nonlocal done
        done += frames
        on_progress(done, dataset.frames * len(known.parts))

    arms = []
    for old in known.parts:
        retargeting = Retargeting.between(old.space.arm, parts[old.label].space.arm, scale)
        commanded = [known.angles(old, each) for each in vectors]
        measured = None if states is None else [known.angles(old, each) for each in states]
        paths, deviations = _follow(retargeting, commanded, measured, dataset.fps, advance)
        arms.append(RetargetedArm(old, parts[old.label], retargeting, paths, deviations))
    others = np.concatenate(vectors)[:, known.other_indices]
    joints = layout.join([np.concatenate(arm.paths[COMMANDED]) for arm in arms], others).astype(np.float32)
    columns = {ACTION: Column(action_feature(layout, dataset.features[ACTION]), joints)}
    for side in (LEADER_JOINTS, SOURCE_ACTION):
        if dataset.names(side) == known.names:  # left as they are, they might pass for the new arm's
            columns[side] = Column(dataset.features[side] | vector_feature(layout.names), joints)
    if states is not None:
        names, values = _state(dataset, arms)
        columns[STATE] = Column(dataset.features[STATE] | vector_feature(names), values)
    with atomic_folder(target) as partial:
        rewrite(dataset, partial, columns, {})
        (partial / RECORD).unlink(missing_ok=True)
        info = load_info(partial)
        info.robot_type = "_".join(part.space.arm.name for part in layout.parts)
        write_info(info, partial)
        name = dataset.root.resolve().name if Path(source).exists() else source  # without its place on this machine
        card.sign(Dataset(partial), name, {"retargeted": {each.name: each.origin() for each in arms}}, repo_id=repo_id)
    return Retargeted(dataset, known, vectors, tuple(arms))


def _follow(
    retargeting: Retargeting,
    commanded: list[Array],
    measured: list[Array] | None,
    fps: float,
    advance: Callable[[int], object],
) -> tuple[dict[str, list[Array]], dict[str, list[Deviation]]]:
    """Paths and deviations: of the commands from frame to frame, of what was measured from the frame's command."""
    goals = {COMMANDED: [retargeting.goals(q) for q in commanded]}
    paths = {COMMANDED: retargeting.follow(goals[COMMANDED], fps, advance)}
    if measured is not None:
        goals[MEASURED] = [retargeting.goals(q) for q in measured]
        near = zip(goals[MEASURED], paths[COMMANDED], strict=True)
        paths[MEASURED] = [retargeting.reached(*each, within=retargeting.within(fps)) for each in near]
    deviations = {
        what: [retargeting.deviation(*each, fps) for each in zip(goals[what], paths[what], strict=True)]
        for what in paths
    }
    return paths, deviations


def _state(dataset: Dataset, arms: Sequence[RetargetedArm]) -> tuple[tuple[str, ...], Floats]:
    """Names and values (N, k) of the state with the new arms' joints and end-effector poses."""
    names = exchanged(dataset.names(STATE), [(arm.old.motors.state, arm.new.motors.state) for arm in arms])
    columns = dict(zip(dataset.names(STATE), dataset.vectors(STATE).T, strict=True))
    for arm in arms:
        pose = make_arm_space(TASK, arm.new.space.arm)
        poses = np.concatenate([pose.encode(q) for q in arm.paths[MEASURED]])
        for separator in "_.":
            prefix = f"{arm.old.label}{separator}" if arm.old.label else ""
            own = zip((*POSITION_NAMES, *Quaternion.names), poses.T, strict=True)
            columns |= {prefix + name: values for name, values in own if prefix + name in columns}
    for arm in arms:
        values = arm.new.motors.values(np.concatenate(arm.paths[MEASURED]))
        columns |= dict(zip(arm.new.motors.state, values.T, strict=True))
    return names, np.stack([columns[name] for name in names], axis=1).astype(np.float32)
