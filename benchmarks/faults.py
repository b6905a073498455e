"""A fault programme: kills, damaged inputs, and actions that mean nothing.

    uv run python benchmarks/faults.py  # results/faults/report.json

Commands are killed at moments spread over their time and run again; inputs are damaged by drawn mutations; commanders
and environments are given actions that no policy should predict. The report counts what was not as it is promised: a
run that was resumed gives what an undisturbed one gives, damage is told in a line, no command leaves the arm's limits.
More than an hour on two cores; the same command goes on where it was interrupted.
"""

import json
import os
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import tyro
import yaml
from fault_actions import fuzz_commanders, fuzz_environments
from fault_inputs import TASK, TRIALS, try_damaged
from fault_kills import commands, kill_often
from faulty import preloaded
from lerobot.datasets import LeRobotDataset
from rich.progress import Progress

from er_il.arms.arm import Arm
from er_il.arms.urdf import example_robot_data
from er_il.datasets.dataset import Dataset
from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.experiments.grid import Grid
from er_il.experiments.plan import Plan
from er_il.policy.configuration import default_config
from er_il.policy.training import Training
from er_il.support.atomic_files import write_json
from er_il.support.provenance import provenance
from er_il.support.workers import ONE_THREAD, cores


def prepare(data: Path) -> None:
    """Write what the commands read: demonstrations encoded and plain, a policy, a robot, a grid and another one."""
    recipe = Recipe.load(TASK).resized(3)
    made = generate(recipe, ["joint", "erj"], data / "demos", Progress(disable=True), workers=1)
    shutil.copytree(made.paths["erj"], data / "erj")
    seen = generate(
        recipe.replaced(cameras=("wrist",), image_size=32),
        ["erj"],
        data / "seen_demos",
        Progress(disable=True),
        workers=1,
    )
    shutil.copytree(seen.paths["erj"], data / "seen")
    _write_plain(Dataset(made.paths["joint"]), data / "plain")
    training = Training(TASK, "erj", data / "erj", data / "training", default_config("erj"), 2, seed=0)
    with (data / "training.txt").open("w") as log:
        if code := training.run(log):
            raise RuntimeError(f"The training ended with exit code {code}.")
    shutil.copytree(training.policy, data / "policy")
    (data / "robot").mkdir()
    shutil.copy(example_robot_data("panda_description/urdf/panda.urdf"), data / "robot/arm.urdf")
    joints = [f"{joint}.pos" for joint in Arm.preset("panda").joints]
    wiring = {"only": {"arm": "arm.urdf", "ee_frame": "panda_hand_tcp", "joints": joints, "signs": [1] * len(joints)}}
    (data / "robot/arms.yaml").write_text(yaml.safe_dump(wiring))
    (data / "grid").mkdir()
    shutil.copy(Path(__file__).parents[1] / "configs/table1.yaml", data / "grid/grid.yaml")
    # Of another grid, by its title: whatever is read, nothing is computed.
    other = Grid.from_dict({**Grid.from_file(data / "grid/grid.yaml").to_dict(), "title": "Another grid"})
    with Plan(other, data / "other_grid").claimed():
        pass


def _write_plain(source: Dataset, root: Path) -> None:
    """Write demonstrations in joint space as LeRobot records them, without a word about the arm."""
    names = [*(f"{joint}.pos" for joint in Arm.preset("panda").joints), "gripper.pos"]
    feature = {"dtype": "float32", "shape": (len(names),), "names": names}
    plain = LeRobotDataset.create(
        "er_il/plain", int(source.fps), {"action": feature, "observation.state": feature}, root=root, use_videos=False
    )
    actions, states = source.vectors("action"), source.vectors("observation.state")[:, : len(names)]
    for rows in source.episodes.values():
        for action, state in zip(actions[rows], states[rows], strict=True):
            plain.add_frame({"action": action, "observation.state": state, "task": "Push the button."})
        plain.save_episode()
    plain.finalize()


def _parts(total: int, size: int) -> Iterator[tuple[int, int]]:
    """Index and size of the parts of a job, of which each is kept by itself."""
    for part, start in enumerate(range(0, total, size)):
        yield part, min(size, total - start)


def _count(rows: list[dict[str, Any]], part: dict[str, Any]) -> None:
    """Add a part's counts and faults to the row of its command, if there is one."""
    row = next((row for row in rows if row.get("command") == part.get("command")), None)
    if row is None:
        rows.append(part)
        return
    for key, value in part.items():
        if isinstance(value, dict):
            row[key] = dict(sorted((Counter(row[key]) + Counter(value)).items()))
        elif not isinstance(value, str):
            row[key] += value


def main(
    kills: int = 100,
    damages: int = 1000,
    actions: int = 1_000_000,
    steps: int = 100_000,
    seed: int = 0,
    out: Path = Path("results/faults"),
) -> None:
    """Run the programme; write the report.

    Args:
        kills: Number of kills, over all commands, at least one each; 0 for none.
        damages: Number of damaged inputs, over all commands, at least one each; 0 for none.
        actions: Number of actions for commanders; 0 for none.
        steps: Number of actions for environments; 0 for none. A part that is not asked for stays in the report.
        seed: Seed of everything that is drawn.
        out: Folder of the report.
    """
    os.environ |= ONE_THREAD
    with TemporaryDirectory() as name:
        folder = Path(name)
        data = folder / "data"
        if kills or damages:
            prepare(data)
        jobs: list[tuple[str, Callable[..., Any], tuple[Any, ...]]] = []
        planned = commands(data) if kills else ()
        total = sum(command.share for command in planned)
        for index, command in enumerate(planned):
            for part, count in _parts(max(1, round(kills * command.share / total)), 10):
                place = folder / f"kills_{index}_{part}"
                jobs.append(("kills", kill_often, (index, count, seed + part, data, place)))
        for index in range(len(TRIALS) if damages else 0):
            count = damages // len(TRIALS) + (index < damages % len(TRIALS))
            for part, some in _parts(max(1, count), 30):
                place = folder / f"inputs_{index}_{part}"
                jobs.append(("inputs", try_damaged, (index, some, seed + part, data, place)))
        jobs += [("commands", fuzz_commanders, (count, seed + part)) for part, count in _parts(actions, 50_000)]
        jobs += [("environments", fuzz_environments, (count, seed + part)) for part, count in _parts(steps, 10_000)]
        # A job's row is kept as soon as it is there: the same command goes on where it was interrupted.
        code = provenance()["git"]
        kept = {index: out / "jobs" / f"{index}.json" for index in range(len(jobs))}
        asked = {
            index: [code, kind, *(each for each in arguments if isinstance(each, int))]
            for index, (kind, _, arguments) in enumerate(jobs)
        }
        found = {index: json.loads(path.read_text()) for index, path in kept.items() if path.exists()}
        done = {index: each["row"] for index, each in found.items() if each["of"] == asked[index]}
        with Progress() as progress, ProcessPoolExecutor(cores(), mp_context=preloaded()) as executor:
            bar = progress.add_task("Faults", total=len(jobs), completed=len(done))
            running: dict[Future[Any], int] = {
                executor.submit(function, *arguments): index
                for index, (_, function, arguments) in enumerate(jobs)
                if index not in done
            }
            try:
                for future in as_completed(running):
                    index = running[future]
                    done[index] = future.result()
                    write_json(kept[index], {"of": asked[index], "row": done[index]})
                    progress.advance(bar)
            finally:  # a job that cannot be done ends the programme at once
                executor.shutdown(cancel_futures=True)
    rows: dict[str, list[Any]] = {kind: [] for kind in ("kills", "inputs", "commands", "environments")}
    for index, (kind, *_) in enumerate(jobs):
        _count(rows[kind], done[index] | {"git": code})
    report = out / "report.json"
    if report.exists():  # what was not asked for this time stays, with the commit that it was found at
        found_before = json.loads(report.read_text())
        for kind in (kind for kind in rows if not rows[kind]):
            rows[kind] = [{"git": found_before["meta"]["git"]} | row for row in found_before[kind]]
    write_json(report, {"meta": provenance() | {"seed": seed, "task": TASK}, **rows})
    shutil.rmtree(out / "jobs")
    for row in (*rows["kills"], *rows["inputs"]):
        for fault in row["faults"]:
            print(row["command"], fault)


if __name__ == "__main__":
    tyro.cli(main)
