"""``er-il generate``: record demonstrations as LeRobot datasets."""

from collections import Counter
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg


def generate(
    task: Positional[str],
    *,
    spaces: str = "joint,task,erj",
    episodes: int | None = None,
    seed: int | None = None,
    arm: str | None = None,
    cameras: Annotated[str | None, arg(metavar="NAME,NAME")] = None,
    size: int | None = None,
    weights: Path | None = None,
    chunk: int = 20,
    agent: Path | None = None,
    out: Path | None = None,
) -> None:
    """Record demonstrations of a task and write one LeRobot dataset a space.

    What is not given comes from the task's recipe. Interrupted, the same command resumes.

    Args:
        task: Task, such as reach_cup.
        spaces: Action spaces, separated by commas: joint, task, erj, era, erx, or erj@JOINT to command another
            joint, era@stereo for another reference of the arm angle. With rel_ in front, policies see chunks of these
            actions relative to the state.
            They name the datasets' folders.
        episodes: Number of demonstrations.
        seed: Seed of the demonstrations.
        arm: Arm that does the task: panda, or panda8 with eight joints; openarm_v2 for a task with two arms.
        cameras: Cameras to record, separated by commas, such as wrist,shoulder.
        size: Width and height of the cameras' images [px].
        weights: File of the weights of erx, which er-il advise --fit erx writes; those of the arm if omitted.
        chunk: Actions of a chunk, of a space with rel_ in front: that of the policy or more.
        agent: Folder of a trained agent (er-il rl train), which demonstrates instead of the leader, 10 times a second.
        out: Folder of the datasets; datasets/<task> if omitted, and datasets/<task>_<arm> for another arm than the
            recipe's.
    """
    from rich.console import Console

    from er_il.arms.robot import robot_arms
    from er_il.cli.progress import make_progress
    from er_il.datasets.recipe import Recipe
    from er_il.datasets.weights import read_weights
    from er_il.support.workers import cores

    recipe = usual = Recipe.load(task)
    if episodes is not None:
        recipe = recipe.resized(episodes)
    given = {"seed": seed, "arm": arm, "cameras": _split(cameras), "image_size": size}
    recipe = recipe.replaced(**{key: value for key, value in given.items() if value is not None})
    asked = _split(spaces) or ()
    file = read_weights(weights, asked)
    rows = file.of(robot_arms(recipe.arm)) if file else {}
    from er_il.datasets.demos import LEADER
    from er_il.datasets.recording import generate as generate_datasets
    from er_il.support.counts import tally

    demonstrator = LEADER
    if agent is not None:
        from er_il.rl.demonstrator import AgentDemonstrator

        demonstrator = AgentDemonstrator(agent.resolve())
        recipe = demonstrator.recipe(recipe)
    name = task if recipe.arm == usual.arm else f"{task}_{recipe.arm}"
    folder = out if out is not None else Path("datasets") / name
    console = Console()
    with make_progress(console) as progress:
        generated = generate_datasets(recipe, asked, folder, progress, cores(), rows, chunk, demonstrator)
    for space, path in generated.paths.items():
        console.print(
            f"{path}: {'written' if space in generated.new else 'was there already'}", highlight=False, soft_wrap=True
        )
    dropped = tally(Counter(generated.dropped.values()))
    console.print(
        f"{recipe.episodes} demonstrations, {len(generated.dropped)} dropped{f' ({dropped})' * bool(dropped)}."
    )


def _split(names: str | None) -> tuple[str, ...] | None:
    return None if names is None else tuple(name.strip() for name in names.split(",") if name.strip())
