"""``er-il train``: train a policy with LeRobot's own command."""

from pathlib import Path

from tyro.conf import Positional


def train(
    task: Positional[str],
    space: Positional[str],
    *,
    steps: int | None = None,
    seed: int = 0,
    dataset: Path | None = None,
    config: Path | None = None,
    out: Path | None = None,
) -> None:
    """Train a policy on a dataset's training episodes; prints the stock command, and runs it with its data in memory.

    Interrupted, the same command resumes from the last checkpoint.

    Args:
        task: Task, such as reach_cup.
        space: Action space of the dataset: joint, task, erj, era, erj@JOINT, era@stereo, or rel_erj and the like.
        steps: Training steps; the configuration's if omitted.
        seed: Seed of the training.
        dataset: Folder of the dataset; datasets/<task>/<space> if omitted.
        config: Configuration of the training; configs/act_<space>.yaml if omitted.
        out: Folder of the policy; policies/<task>/<space> if omitted.
    """
    import sys

    from er_il.envs.tasks import task_id
    from er_il.policy.configuration import default_config, default_steps
    from er_il.policy.training import Training
    from er_il.spaces.registry import check_space
    from er_il.support.atomic_files import check_outside, check_writable

    task_id(task)
    check_space(space)
    chosen = config or default_config(space)
    training = Training(
        task=task,
        space=space,
        dataset=dataset or Path("datasets") / task / space,
        out=out or Path("policies") / task / space,
        config=chosen,
        steps=default_steps(chosen) if steps is None else steps,
        seed=seed,
    )
    check_outside(training.out, training.dataset)
    check_writable(training.out)
    if training.finished:
        print(
            f"{training.policy}: trained already, for {training.done_steps} steps. Remove {training.out} to start anew."
        )
        return
    if code := training.run():
        sys.exit(code)
    print(training.policy)
