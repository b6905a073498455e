"""``er-il rl``: reinforcement learning: train an agent, and evaluate it."""

from pathlib import Path
from typing import Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, subcommand


def train(
    task: Positional[str],
    mode: Positional[str],
    *,
    steps: int = 100_000,
    seed: int = 0,
    arm: str = "panda",
    pixels: bool = False,
    config: Path | None = None,
    film: bool = True,
    out: Path | None = None,
) -> None:
    """Train an agent by SAC. Interrupted, or asked for more steps, the same command goes on from the last checkpoint.

    Args:
        task: Task, such as reach_elbow_pose.
        mode: Action mode: joint, task, erj, era, erx, erj-free, erx-free, jailer, jailer-rew; erj@JOINT commands
            another joint.
        steps: Decisions to learn from.
        seed: Seed of the training.
        arm: Arm that does the task: panda, or panda8 with eight joints.
        pixels: Observe the cameras wrist and front instead of the objects' places.
        config: Settings of SAC; configs/sac.yaml if omitted, with pixels configs/sac_pixels.yaml.
        film: Film the trained agent once, from the first of the starts that it is evaluated on.
        out: Folder of the agent; policies/<task>/rl_<mode> if omitted.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.envs.tasks import task_id
    from er_il.rl.modes import has_controller
    from er_il.rl.settings import Settings
    from er_il.support.atomic_files import check_writable
    from er_il.support.errors import ErIlError

    if steps < 1:
        raise ErIlError(f"{steps} steps are too few: at least one is needed.")
    task_id(task)
    has_controller(mode)
    settings = Settings.from_file(config) if config else Settings.shipped(pixels)
    folder = out or Path("policies") / task / f"rl_{mode}"
    check_writable(folder)
    from er_il.rl.training import AgentTraining

    training = AgentTraining(task, mode, steps, seed, settings, folder, arm, pixels)
    console = Console()
    if training.finished:
        console.print(f"{folder}: trained already. Ask for more --steps to go on.", highlight=False, soft_wrap=True)
    with make_progress(console) as progress:
        bar = progress.add_task(f"{task}, {mode}", total=steps)
        milestones = training.run(
            lambda done, text: progress.update(bar, completed=done, description=f"{task}, {mode} {text}".rstrip())
        )
    last = milestones[-1]
    console.print(
        f"{folder}: success {last.successes}/{last.episodes} after {last.steps:,} decisions",
        highlight=False,
        soft_wrap=True,
    )
    if film:
        from er_il.evaluation.rollout import FIRST_SEED
        from er_il.rl.assessment import film as film_episodes
        from er_il.rl.loading import load_agent

        for path in film_episodes(load_agent(folder), [FIRST_SEED], folder):
            console.print(str(path), highlight=False, soft_wrap=True)


def evaluate(
    agent: Positional[Path],
    *,
    episodes: int = 100,
    seed: int = 1000,
    films: int = 1,
    out: Path | None = None,
) -> None:
    """Evaluate a trained agent, without exploration, on starts that it did not learn from.

    Args:
        agent: Folder of the agent: a training's output, or the pretrained model in it.
        episodes: Number of episodes.
        seed: Seed of the first.
        films: Episodes to film, each with a recording for er-il view.
        out: Folder of report.json, episodes.csv and the films; outputs/rl/<task>/<mode> if omitted.
    """
    from rich.console import Console

    from er_il.policy.training import pretrained
    from er_il.support.errors import ErIlError

    if episodes < 1 or films < 0:
        raise ErIlError("Ask for at least one episode, and for no fewer films than none.")
    pretrained(agent)  # seconds of imports follow: mistakes are told before
    from er_il.cli.progress import make_progress
    from er_il.rl.assessment import assess
    from er_il.rl.loading import load_agent

    console = Console()
    policy = load_agent(agent)
    folder = out or Path("outputs/rl") / policy.config.task / policy.config.mode
    with make_progress(console) as progress:
        bar = progress.add_task(f"{policy.config.task}, {policy.config.mode}", total=episodes + min(films, episodes))
        report = assess(policy, range(seed, seed + episodes), films, folder, lambda: progress.advance(bar))
    low, high = report["interval"]
    console.print(
        f"Success {report['successes']}/{episodes} (exact 95 % interval {low:.1%} to {high:.1%})\n"
        f"Invalid actions: {report['invalid_rate']:.1%}\n{folder}",
        highlight=False,
        soft_wrap=True,
    )


Rl = (
    Annotated[Any, subcommand("train", constructor=train, prefix_name=False)]
    | Annotated[Any, subcommand("eval", constructor=evaluate, prefix_name=False)]
)


def rl(which: OmitArgPrefixes[Rl]) -> None:
    """Reinforcement learning: train an agent in an action mode, and evaluate it."""
