"""One episode of an agent, recorded in full: a trace, and a film."""

from typing import Any

import numpy as np

from er_il.envs.learning import RATE, LearningEnv
from er_il.evaluation.recording import SUCCESS, Picture
from er_il.evaluation.rollout import TIMEOUT
from er_il.evaluation.trace import Trace
from er_il.rl.evaluation import Act
from er_il.spaces.action_space import ActionSpace


def record_episode(act: Act, env: LearningEnv, task: str, label: str, seed: int) -> tuple[Trace, list[Picture]]:
    """Act as :func:`er_il.rl.evaluation.roll_out` does, with a picture of each decision and one of the end.

    Args:
        act: The agent.
        env: Its environment, with ``render_mode="rgb_array"``.
        task: Name of the task.
        label: Who acts.
        seed: Of the start.
    """
    rows: dict[str, list[Any]] = {key: [] for key in ("q", "gripper", "action", "command", "status", "state")}
    pictures: list[Picture] = []
    observation, info = env.reset(seed=seed)
    done = False
    while not done:
        pictures.append(env.render())
        action = act(observation)
        rows["q"].append(env.world.joint_positions)
        rows["gripper"].append(env.world.gripper_opening)
        rows["state"].append(env.seen["environment_state"])
        rows["action"].append(env.change(action))
        observation, _, terminated, truncated, info = env.step(action)
        rows["command"].append(info["command"])
        rows["status"].append(info["decode_status"])
        done = terminated or truncated
    pictures.append(env.render())
    trace = Trace(
        task=task,
        seed=seed,
        period=1 / RATE,
        label=label,
        outcome=SUCCESS if info["is_success"] else info["failure"] or TIMEOUT,
        spec=ActionSpace(env.space).spec(),
        q=np.array(rows["q"]),
        gripper=np.array(rows["gripper"], dtype=np.float64),
        action=np.array(rows["action"]),
        command=np.array(rows["command"]),
        status=tuple(rows["status"]),
        environment_state=np.array(rows["state"], dtype=np.float64),
        environment_state_names=env.world.environment_state_names,
    )
    return trace, pictures
