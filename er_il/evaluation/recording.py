"""One rollout of a trained policy, recorded in full: a trace, and a film if wanted.

The trace of a robot with several arms is that of its first; the film shows all.
"""

from collections import defaultdict
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from lerobot.envs.utils import NEW_ROLLOUT_OPTION
from numpy.typing import NDArray

from er_il.envs.contract import check_policy
from er_il.envs.protocol import openings_of
from er_il.evaluation.rollout import TIMEOUT
from er_il.evaluation.trace import Trace
from er_il.policy.actor import Actor, environment_of, one_thread
from er_il.spaces.action_space import ActionSpace

SUCCESS = "success"
PICTURE = (640, 480)  # [px] width and height
Picture = NDArray[np.uint8]  # (H, W, 3)


class TraceRecorder:
    """Gathers the rows of a trace while an episode runs."""

    def __init__(self) -> None:
        self._rows: defaultdict[str, list[Any]] = defaultdict(list)

    def __len__(self) -> int:
        return len(self._rows["q"])

    def add(self, **values: Any) -> None:
        """Add some of a row's values: what was measured before the action, the action, or what became of it."""
        for key, value in values.items():
            self._rows[key].append(value)

    def trace(self, info: Mapping[str, Any], **known: Any) -> Trace:
        """Return the trace.

        Args:
            info: What the environment said with the last observation.
            known: The trace's other values, the same in all rows.
        """
        return Trace(
            **known,
            outcome=SUCCESS if info["is_success"] else info["failure"] or TIMEOUT,
            q=self._array("q"),
            gripper=self._array("gripper"),
            action=self._array("action"),
            command=self._array("command"),
            status=tuple(self._rows["status"]),
            environment_state=self._array("environment_state"),
        )

    def _array(self, key: str) -> NDArray[np.float64]:
        return np.array(self._rows[key], dtype=np.float64)


def record_rollout(
    policy: Path, task: str, decoder_name: str, seed: int, film_every: int = 0, within: float | None = None
) -> tuple[Trace, list[Picture]]:
    """Roll a policy out once, exactly as :func:`er_il.evaluation.rollouts.evaluate` does on that seed.

    Args:
        policy: Folder of the pretrained policy.
        task: Name of the task.
        decoder_name: ``joint``, ``task-nearest``, ``task-posture``, ``task-clear``, ``erj``, ``era``.
        seed: Seed of the initial state.
        film_every: Take a picture each so many control steps, and one at the end; 0: none.
        within: See :func:`er_il.evaluation.rollouts.evaluate`.
    """
    config = environment_of(policy, task, decoder_name, within=within)
    config.visualization_width, config.visualization_height = PICTURE
    recorder = TraceRecorder()
    pictures: list[Picture] = []
    with closing(config.make()) as env, one_thread():
        check_policy(policy, env.layout)
        actor = Actor.load(policy, config)
        world, layout = env.world, env.layout
        part = layout.parts[0]
        openings = openings_of(world)
        observation, info = env.reset(seed=seed, options={NEW_ROLLOUT_OPTION: True})
        actor.reset(seed)
        done = False
        while not done:
            if film_every and len(recorder) % film_every == 0:
                pictures.append(world.render())
            recorder.add(
                q=world.joint_positions[: part.space.arm.dof],
                gripper=openings()[0],
                environment_state=observation["environment_state"],
            )
            action = actor.act(_batched(observation), world.task_description)[0]
            observation, _, terminated, truncated, info = env.step(action)
            actions, grippers = layout.split_encoded(action)
            recorder.add(
                action=np.append(actions[0], grippers[0]),
                command=info["command"][: part.space.arm.dof],
                status=info["decode_status"],
            )
            done = terminated or truncated
        if film_every:
            pictures.append(world.render())
        trace = recorder.trace(
            info,
            task=task,
            seed=seed,
            period=1 / env.metadata["render_fps"],
            label=decoder_name,
            spec=ActionSpace(part.space).spec(),
            environment_state_names=world.environment_state_names,
        )
    return trace, pictures


def _batched(observation: dict[str, Any]) -> dict[str, Any]:
    """Add the leading dimension that a vector environment gives to every entry."""
    return {
        key: _batched(value) if isinstance(value, dict) else np.asarray(value)[None]
        for key, value in observation.items()
    }
