"""Where the time of a training goes: LeRobot's own command beside `er-il train`, which keeps frames in memory.

    uv run python benchmarks/training_time.py  # results/training_time/report.json
    uv run python docs/render_readme.py  # the table of docs/policies.md

Both train the same policies on the same batches, one after the other, from states and from one camera of 96 x 96 px.
LeRobot itself logs what loading a batch and updating the policy took. Most images have been seen before then: what is
told is the pace of a long training.
"""

import os
import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import tyro
import yaml
from rich.progress import Progress

from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.policy.configuration import default_config
from er_il.policy.training import IN_MEMORY, STOCK, Training
from er_il.support.atomic_files import write_json
from er_il.support.provenance import provenance
from er_il.support.workers import ONE_THREAD

TASK, SPACE = "reach_cup", "erj"
INPUTS = {"states": "", "states and a camera": "images_small"}  # and the configuration's kind
COMMANDS = {STOCK: "lerobot.scripts.lerobot_train", "er-il train": IN_MEMORY}  # and their modules
LOGGED = re.compile(r"updt_s:([\d.]+) data_s:([\d.]+)")


def measure(training: Training, module: str, window: int) -> tuple[float, float]:
    """Seconds to load a batch and to update the policy: means over the last window of steps."""
    options = [f"--log_freq={window}", "--save_checkpoint=false"]
    command = [sys.executable, "-m", module, *training.command[1:], *options]
    out = subprocess.run(command, env=ONE_THREAD | os.environ, capture_output=True, text=True, check=True)
    update, load = LOGGED.findall(out.stdout + out.stderr)[-1]
    return float(load), float(update)


def main(demonstrations: int = 5, window: int = 30, out: Path = Path("results/training_time")) -> None:
    """Measure both commands on both inputs; write the report."""
    recipe = Recipe.load(TASK).replaced(cameras=("wrist",)).resized(demonstrations)
    rows = []
    with TemporaryDirectory() as folder, Progress() as progress:
        data = Path(folder) / "data"
        generate(recipe, [SPACE], data, progress, workers=1)
        bar = progress.add_task("Train", total=len(INPUTS) * len(COMMANDS))
        for inputs, kind in INPUTS.items():
            config = default_config(SPACE, kind)
            for name, module in COMMANDS.items():
                runs = Path(folder) / f"{name}_{kind}"
                training = Training(TASK, SPACE, data / SPACE, runs, config, steps=3 * window, seed=0)
                load, update = measure(training, module, window)
                batch = yaml.safe_load(config.read_text())["batch_size"]
                rows.append({"inputs": inputs, "command": name, "batch": batch, "load_s": load, "update_s": update})
                progress.advance(bar)
    meta = {"task": TASK, "space": SPACE, "trained_on": recipe.episodes - recipe.validation, "steps": window}
    write_json(out / "report.json", {"meta": provenance() | meta, "training_times": rows})


if __name__ == "__main__":
    tyro.cli(main)
