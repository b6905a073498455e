"""``er-il eval``: roll a trained policy out and count."""

from pathlib import Path

from tyro.conf import Positional


def eval(
    policy: Positional[Path],
    *,
    task: str,
    decoder: str,
    episodes: int = 50,
    seed: int = 1000,
    on_invalid: str = "best_effort",
    out: Path | None = None,
    trust: bool = False,
) -> None:
    """Roll a trained policy out through a decoder, on initial states that no demonstration had.

    Args:
        policy: Folder of the policy: a training's output, or the pretrained model in it.
        task: Task, such as reach_cup.
        decoder: joint, task-nearest, task-posture, task-clear, erj, era, erx, erj@JOINT, era@stereo; with rel_ in
            front, as in rel_erj, of a chunk-relative policy.
        episodes: Number of rollouts.
        seed: Seed of the first; the same seeds give every decoder the same initial states.
        on_invalid: What the arm does with an action that cannot be decoded: best_effort, hold, stop.
        out: Folder of report.json and episodes.csv; outputs/eval/<task>/<decoder> if omitted.
        trust: Let the policy's processors import what they name: they may run any program.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.evaluation.checks import check_evaluation
    from er_il.policy.training import pretrained
    from er_il.support.atomic_files import check_writable

    folder = out or Path("outputs/eval") / task / decoder
    check_writable(folder)
    found = pretrained(policy)
    # Seconds of imports follow: mistakes are told before.
    check_evaluation(found, task, decoder, episodes, on_invalid, trust)
    from er_il.evaluation.results import COUNTS, as_csv, long_form, summarise
    from er_il.evaluation.rollouts import evaluate
    from er_il.support.atomic_files import write_atomically, write_json
    from er_il.support.counts import tally
    from er_il.support.provenance import provenance

    console = Console()
    with make_progress(console) as progress:
        bar = progress.add_task(f"{task}, {decoder}", total=episodes)
        done = evaluate(
            found,
            task,
            decoder,
            episodes=episodes,
            seed=seed,
            on_invalid=on_invalid,
            trust=trust,
            advance=lambda count: progress.update(bar, advance=count),
        )
    meta = provenance() | {"policy": str(policy), "first_seed": seed, "episodes": episodes, "on_invalid": on_invalid}
    rollouts = long_form([({"task": task, "decoder": decoder}, done)])
    report = summarise(rollouts)
    write_json(folder / "report.json", {"meta": meta, "cells": [{"task": task, "decoder": decoder} | report]})
    text = as_csv(rollouts, ["task", "decoder", *COUNTS])
    write_atomically(folder / "episodes.csv", lambda path: path.write_text(text))
    low, high = report["interval"]
    failures = tally(report["failures"]) or "none"
    console.print(
        f"Success {report['successes']}/{episodes} (exact 95 % interval {low:.1%} to {high:.1%})\n"
        f"Failures: {failures}\n"
        f"Invalid actions: {report['invalid_rate']:.1%}; largest joint step {report['max_joint_step']:.3f} rad; "
        f"decode p50 {report['decode_p50_ms']:.2f} ms, p99 {report['decode_p99_ms']:.2f} ms\n"
        f"{folder / 'report.json'}",
        highlight=False,
    )
