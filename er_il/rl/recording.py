"""One episode of an agent, recorded in full: a trace, and a film."""

from pathlib import Path

from er_il.envs.learning import RATE, LearningEnv
from er_il.evaluation.recording import Picture, TraceRecorder
from er_il.evaluation.trace import Trace
from er_il.report.films import write_film
from er_il.rl.evaluation import Act
from er_il.spaces.action_space import ActionSpace
from er_il.viewer.show import save_rollout


def film_episode(act: Act, env: LearningEnv, task: str, label: str, seed: int, film: Path) -> None:
    """Record as :func:`record_episode` does: a film (.mp4), a Rerun recording (.rrd) and a trace (.npz, last)."""
    trace, pictures = record_episode(act, env, task, label, seed)
    write_film(pictures, film, RATE)
    save_rollout(trace, film.with_suffix(".rrd"))
    trace.save(film.with_suffix(".npz"))


def record_episode(act: Act, env: LearningEnv, task: str, label: str, seed: int) -> tuple[Trace, list[Picture]]:
    """Act as :func:`er_il.rl.evaluation.roll_out` does, with a picture of each decision and one of the end.

    Args:
        act: The agent.
        env: Its environment, with ``render_mode="rgb_array"``.
        task: Name of the task.
        label: Who acts.
        seed: Of the start.
    """
    recorder = TraceRecorder()
    pictures: list[Picture] = []
    observation, info = env.reset(seed=seed)
    done = False
    while not done:
        pictures.append(env.render())
        action = act(observation)
        recorder.add(
            q=env.world.joint_positions,
            gripper=env.world.gripper_opening,
            environment_state=env.seen["environment_state"],
            action=env.change(action),
        )
        observation, _, terminated, truncated, info = env.step(action)
        recorder.add(command=info["command"], status=info["decode_status"])
        done = terminated or truncated
    pictures.append(env.render())
    trace = recorder.trace(
        info,
        task=task,
        seed=seed,
        period=1 / RATE,
        label=label,
        spec=ActionSpace(env.space).spec(),
        environment_state_names=env.world.environment_state_names,
    )
    return trace, pictures
