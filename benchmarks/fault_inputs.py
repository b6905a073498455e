"""Commands given damaged datasets, policies, robots and grids: does a line tell the damage, or what happens else?"""

import re
import shutil
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from damage import Damage, damage
from faulty import LOG, start
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st

from er_il.datasets.dataset import Dataset
from er_il.datasets.schema import LEADER_JOINTS
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.spec import ACTION

PATIENCE = 300.0  # [s] until a command counts as hanging, on a busy machine
TOLD, ACCEPTED = "told", "accepted"
FAULTS = ("traceback", "crash", "hang", "silently wrong")
POSITION_TOLERANCE = 1e-3  # [m] between an action's pose and that of its joints
TASK = "push_button_elbow"  # its demonstrations are the shortest
# What a stock training says, with tracebacks, where torchcodec lacks FFmpeg: LeRobot then decodes videos by PyAV.
LIBRARY = re.compile(r"\[start of libtorchcodec loading traceback\].*?\[end of libtorchcodec", re.DOTALL)
_FRAME = ("--ee-frame", "panda_hand_tcp")


@dataclass(frozen=True)
class Trial:
    """A command and the input that it reads, a folder or file of the data folder."""

    arguments: tuple[str, ...]  # {input}: the damaged copy; {data}: the undamaged folder
    input: str
    check: Callable[[Path, Path], str] = lambda given, out: ""  # what an accepted input has made wrong


def _poses_disagree(given: Path, out: Path) -> str:
    """Why an encoded dataset should not have been accepted: its actions are not the poses of its joints."""
    dataset = Dataset(given)
    joints, actions = dataset.vectors(LEADER_JOINTS).astype(np.float64), dataset.vectors(ACTION).astype(np.float64)
    if not (np.all(np.isfinite(joints)) and np.all(np.isfinite(actions))):
        return "numbers that are not finite"
    arm = dataset.layout.parts[0].space.arm
    positions = kinematics_of(arm).fk_batch(joints[:, : arm.dof])[:, :3, 3]
    apart = np.linalg.norm(positions - actions[:, :3], axis=1).max() if len(joints) else 0.0
    return f"poses {apart:.3f} m apart" if apart > POSITION_TOLERANCE else ""


def _result_disagrees(given: Path, out: Path) -> str:
    return _poses_disagree(out, out)


TRIALS = (
    Trial(("verify", "{input}", "--out", "out"), "erj", _poses_disagree),
    Trial(("encode", "{input}", "--to", "era", "--out", "out"), "erj", _result_disagrees),
    Trial(("encode", "{input}", "--to", "joint", "--out", "out"), "erj"),
    Trial(("view", "{input}", "--episode", "0", "--save", "out.rrd"), "erj"),
    Trial(("view", "{input}", "--episode", "0", "--save", "out.rrd"), "seen"),
    Trial(("encode", "{input}", "--to", "task", "--out", "out"), "seen", _result_disagrees),
    Trial(("advise", "{input}"), "erj"),
    Trial(("replay", "{input}", "--out", "out"), "erj"),
    Trial(("train", TASK, "erj", "--dataset", "{input}", "--steps", "1", "--out", "out"), "erj"),
    Trial(("eval", "{input}", "--task", TASK, "--decoder", "erj", "--episodes", "1"), "policy"),
    Trial(("attach", "{input}", "--out", "out", "--dataset", "{data}/erj"), "policy"),
    Trial(("encode", "{data}/plain", "--to", "erj", "--out", "out", "--arm", "{input}/arm.urdf", *_FRAME), "robot"),
    Trial(("advise", "{input}/arm.urdf", *_FRAME), "robot"),
    Trial(("encode", "{data}/plain", "--to", "erj", "--arms", "{input}/arms.yaml", "--out", "out"), "robot"),
    Trial(("benchmark", "{input}/grid.yaml", "--out", "{data}/other_grid"), "grid"),
)


def try_damaged(index: int, damages: int, seed: int, data: Path, folder: Path) -> dict[str, Any]:
    """Give a trial damaged inputs.

    Args:
        index: Index of the trial in ``TRIALS``.
        damages: Number of damaged inputs.
        seed: Seed of the damage.
        data: Folder with the undamaged inputs: ``erj``, ``seen``, ``plain``, ``policy``, ``robot``, ``grid``.
        folder: Folder to work in.

    Returns:
        The number of each outcome, and every fault.
    """
    trial, source = TRIALS[index], data / TRIALS[index].input
    files = sorted(str(path.relative_to(source)) for path in source.rglob("*") if path.is_file())
    outcomes: Counter[str] = Counter(dict.fromkeys((TOLD, ACCEPTED, *FAULTS), 0))
    faults: list[dict[str, str]] = []

    @seeded(int(np.random.SeedSequence([seed, index]).generate_state(1)[0]))
    @settings(
        max_examples=damages,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=tuple(HealthCheck),
    )
    @given(st.sampled_from(files).flatmap(lambda name: st.tuples(st.just(name), damage(Path(name).suffix))))
    def attempt(drawn: tuple[str, Damage]) -> None:
        name, (words, spoil) = drawn
        outcome, why = _outcome(trial, name, spoil, data, folder)
        outcomes[outcome] += 1
        if outcome in FAULTS:
            faults.append({"file": name, "damage": words, "outcome": outcome, "why": why})

    attempt()
    command = " ".join(each for each in trial.arguments if "{" not in each and each not in ("out", "--out"))
    return {"command": command, "input": trial.input, "damaged": outcomes.total(), **outcomes, "faults": faults}


def _outcome(trial: Trial, name: str, spoil: Callable[[Path], None], data: Path, folder: Path) -> tuple[str, str]:
    """What a command does with a damaged copy of its input, and a few words."""
    place = folder / "place"
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(data / trial.input, place / "input")
    spoil(place / "input" / name)
    arguments = [each.format(input=place / "input", data=data) for each in trial.arguments]
    process = start(arguments, place)
    process.join(PATIENCE)
    if process.is_alive():
        process.kill()
        process.join()
        return "hang", ""
    said = (place / LOG).read_text(errors="replace").strip()
    if process.exitcode is None or process.exitcode < 0:
        return "crash", f"signal {process.exitcode}"
    if "Traceback (most recent call last)" in LIBRARY.sub("", said):
        return "traceback", said.splitlines()[-1][:300]
    if process.exitcode:
        return (TOLD, "") if said else ("silently wrong", f"exit code {process.exitcode} without a word")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            wrong = trial.check(place / "input", place / "out")
    except Exception as error:
        wrong = f"accepted, though {type(error).__name__}: {error}"[:300]
    return ("silently wrong", wrong) if wrong else (ACCEPTED, "")
