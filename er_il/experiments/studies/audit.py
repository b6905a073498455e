"""The audit of a dataset: what its elbows did, whether a pose determines them, and which space suits them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from er_il.arms.arm import Arm, Vector
from er_il.datasets.joint_paths import JointPath
from er_il.evaluation.elbow_spread import LENGTH, NEAR, SOON, ElbowSpread, elbow_spread
from er_il.evaluation.task_drift import DECODERS, TaskDrift, arm_points, task_drift
from er_il.experiments.studies import Advance
from er_il.experiments.studies.margins import study_margins
from er_il.kinematics.self_motion import margins
from er_il.kinematics.solver import kinematics_of
from er_il.report.elbow_verdict import verdict
from er_il.report.margins import best_joints
from er_il.spaces.base import Array
from er_il.spaces.joint_choice import crossings, sensitivity, singular_intervals
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import make_arm_space
from er_il.spaces.round_trip import SINGULAR
from er_il.support.series import percentiles
from er_il.support.workers import run_jobs

DATA = "data"  # name of the one set of demonstrations
SHARES = (50, 95, 100)  # percentiles
BINS = 10  # of an episode's time in which spread and room are told
DIGITS = 4  # of curves


def study_audit(arm: Arm, paths: Sequence[JointPath], fps: float, workers: int, advance: Advance) -> dict[str, Any]:
    """Measure the elbows of one arm in a dataset; return everything as JSON.

    Args:
        arm: The arm.
        paths: Its episodes.
        fps: Frames a second.
        workers: Number of worker processes.
        advance: Called with the number of measurements done and their total.

    Raises:
        ArmError: the arm has no redundancy.
    """
    q = [path.commanded for path in paths]
    measured = study_margins(arm, {DATA: paths}, workers, lambda done, total: advance(done, total + 1 + len(DECODERS)))
    done = len(measured["margins"])
    total = done + 1 + len(DECODERS)
    drifts = run_jobs(
        [(task_drift, arm, decoder, q) for decoder in DECODERS], workers, lambda n, _: advance(done + n, total)
    )
    spread = elbow_spread(arm, q)
    advance(total, total)
    report = {
        "arm": arm.name,
        "joints": list(arm.joints),
        "fps": fps,
        "episodes": [{"episode": path.episode, "frames": len(path.commanded)} for path in paths],
        "spread": _spread(spread, len(paths)),
        "drift": {drift.decoder: _drift(drift, paths) for drift in drifts},
        "scene": _scene(arm, drifts, q, paths),
        "spaces": [_space(arm, row, q) for row in measured["margins"]],
        "best_joints": best_joints({row["space"]: row for row in measured["margins"]}),
        "coordinates": measured["coordinates"][-1],  # of ERX, fitted to these episodes
        "settings": {"singular": SINGULAR, "near_m": NEAR, "radian_m": LENGTH, "soon": SOON},
    }
    return report | {"verdict": verdict(report)}


def _spread(spread: ElbowSpread, episodes: int) -> dict[str, Any]:
    edges = np.linspace(0.0, 1.0, BINS + 1).astype(np.float64)
    return {
        "frames": spread.frames,
        "covered": spread.covered,
        "pairs": len(spread.angle),
        "pairs_soon": int(spread.soon.sum()),
        "room_rad": float(np.median(np.linalg.norm(spread.room, axis=1))),
        "room_deviation_rad": spread.room_deviation,
        "given_pose": _deviation(spread, timed=False),
        "given_pose_and_time": _deviation(spread, timed=True),
        "of_episode_m": [spread.of_episode(i) for i in range(episodes)],
        "curve": {
            "share": ((edges[1:] + edges[:-1]) / 2).tolist(),
            "room_rad": _binned(spread.room_share, np.linalg.norm(spread.room, axis=1), edges, np.median),
            "deviation_rad": _binned(spread.share, spread.angle, edges, lambda each: np.sqrt((each**2).mean() / 2)),
        },
    }


def _deviation(spread: ElbowSpread, timed: bool) -> dict[str, float] | None:
    found = spread.deviation(timed)
    return found and {"rad": found[0], "m": found[1], "open": found[0] / spread.room_deviation}


def _binned(x: Vector, values: Vector, edges: Vector, summary: Any) -> list[float | None]:
    at = np.clip(np.digitize(x, edges) - 1, 0, BINS - 1)
    return [float(summary(values[at == i])) if (at == i).any() else None for i in range(BINS)]


def _drift(drift: TaskDrift, paths: Sequence[JointPath]) -> dict[str, Any]:
    elbow = np.concatenate(drift.elbow)
    of_episode = [float(each.max()) for each in drift.elbow]
    worst = int(np.argmax(of_episode))
    return {
        "elbow_m": percentiles(elbow, SHARES),
        "end_m": float(np.median([each[-1] for each in drift.elbow])),
        "joint_rad": percentiles(np.concatenate(drift.joints), SHARES),
        "followed": drift.followed,
        "worst_episode": paths[worst].episode,
        "worst_step": int(drift.elbow[worst].argmax()),
        "curves_m": [each.round(DIGITS).tolist() for each in drift.elbow],
    }


def _scene(arm: Arm, drifts: Sequence[TaskDrift], q: Sequence[Array], paths: Sequence[JointPath]) -> dict[str, Any]:
    """The arm's points where the decoder that drifts least is farthest from the recording, and its way there."""
    best = min(drifts, key=lambda drift: float(np.percentile(np.concatenate(drift.elbow), 95)))
    episode = int(np.argmax([each.max() for each in best.elbow]))
    step = int(best.elbow[episode].argmax())
    base = kinematics_of(arm).positions(q[episode][:1], [arm.base_frame])[0]
    arms = {"recorded": q[episode], **{drift.decoder: drift.paths[episode] for drift in drifts}}
    return {
        "episode": paths[episode].episode,
        "step": step,
        "hand": arm_points(arm, q[episode])[:, -1].round(DIGITS).tolist(),
        "base": [float(each[0]) for each in base],
        "arms": {name: arm_points(arm, path[step : step + 1])[0].round(DIGITS).tolist() for name, path in arms.items()},
    }


def _space(arm: Arm, row: dict[str, Any], q: Sequence[Array]) -> dict[str, Any]:
    """Margins of a space along all episodes, and its stretches near folds."""
    space = make_arm_space(row["name"], arm)
    assert isinstance(space, PoseSpace) and space.redundancy is not None
    sensed = [sensitivity(space.redundancy, path) for path in q]
    near = [interval for each in sensed for interval in singular_intervals(each.smallest)]
    return {key: row[key] for key in ("space", "name", "smallest", "p05", "p50", "off", "risk", "episode", "step")} | {
        "near": float(np.mean(np.concatenate([each.smallest for each in sensed]) < SINGULAR)),
        "stretches": len(near),
        "longest": max((each.last - each.first + 1 for each in near), default=0),
        "folds": sum(crossings(each.self_motion) for each in sensed),
        "curve": np.concatenate([margins(space.redundancy, path) for path in q]).round(DIGITS).tolist(),
    }
