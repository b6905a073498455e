"""``er-il attach``: let a trained policy decode for a robot by itself."""

from pathlib import Path

from tyro.conf import Positional


def attach(
    policy: Positional[Path],
    *,
    out: Path,
    dataset: Path | None = None,
    fps: float | None = None,
    on_invalid: str = "best_effort",
    trust: bool = False,
) -> None:
    """Copy a policy, with a last step that decodes its actions for LeRobot's own lerobot-rollout.

    Args:
        policy: Folder of a trained policy, or the output of a training.
        out: Folder of the copy.
        dataset: Dataset that it was trained on; by default where it was then.
        fps: Rate of control [Hz]; the dataset's by default.
        on_invalid: Answer to an invalid action: best_effort, hold or stop.
        trust: Accept a policy whose processors import what they name: they may run any program.
    """
    from er_il.robots.attachment import attach as write_copy

    step = write_copy(policy, out, dataset=dataset, fps=fps, on_invalid=on_invalid, trust=trust)
    print(out)
    print(f"At {1 / step.period:g} Hz it commands {', '.join(step.joint_names)}.")
