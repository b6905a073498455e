"""Training with LeRobot's own command: which one, and how far it has come."""

import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import yaml

from er_il.datasets.dataset import Dataset
from er_il.datasets.integrity import check_whole
from er_il.datasets.recipe import TRAIN
from er_il.envs.contract import Contract
from er_il.policy.configuration import input_features, named_inputs, read_config
from er_il.policy.training_data import check_training_data
from er_il.spaces.registry import AND, check_space, split_name
from er_il.support.atomic_files import work_folder, write_atomically
from er_il.support.errors import DatasetError, PolicyError
from er_il.support.json_files import read_json
from er_il.support.workers import ONE_THREAD, end_with_parent

STOCK = "lerobot-train"
IN_MEMORY = "er_il.policy.in_memory"  # the same, in less time
PRECISION = "ACCELERATE_MIXED_PRECISION"  # heeded by lerobot-train: bf16 is faster where the processor knows it
_CHECKPOINTS, _LAST, _PRETRAINED = "checkpoints", "last", "pretrained_model"


@dataclass(frozen=True)
class Training:
    """One policy to train: from a dataset, by a configuration, into a folder.

    Raises:
        DatasetError: the dataset is missing, or holds actions of another space.
        UnknownNameError: no such action space.
    """

    task: str
    space: str
    dataset: Path
    out: Path
    config: Path
    steps: int
    seed: int
    demonstrations: int | None = None  # the first ones of the dataset's training episodes; all if None

    def __post_init__(self) -> None:
        check_space(self.space)
        if self.steps < 1:
            raise PolicyError(f"{self.steps} training steps train nothing; ask for at least one.")
        if not self.config.is_file():
            raise PolicyError(f"There is no training configuration {self.config}.")
        spec = Dataset(self.dataset).spec
        kind, choice = split_name(self.space)
        if spec["space"] != kind:
            raise DatasetError(f"The dataset at {self.dataset} holds {spec['space']} actions, not {kind}.")
        if choice and (commanded := Contract.of_spec(spec).redundant) != AND.join(choice):
            raise DatasetError(f"The dataset at {self.dataset} commands {commanded}, not {AND.join(choice)}.")

    @property
    def command(self) -> list[str]:
        """The stock command that starts the training, or goes on where it was interrupted."""
        last = self._checkpoint
        if last is not None:
            # Where dataset and output are now: either may have been moved since.
            places = (f"--dataset.root={self.dataset}", f"--output_dir={self.out}")
            config = last / _PRETRAINED / "train_config.json"
            return [STOCK, f"--config_path={config}", "--resume=true", *places, *self._length]
        dataset = Dataset(self.dataset)
        info, contract = dataset.info, Contract.of_spec(dataset.spec)
        inputs = input_features(self.config, info["features"])
        own = self._renames(inputs)
        return [
            STOCK,
            f"--config_path={self.own_config if own else self.config}",
            f"--dataset.repo_id=er_il/{self.task}_{self.space}",
            f"--dataset.root={self.dataset}",
            f"--dataset.episodes={json.dumps(self._episodes(info), separators=(',', ':'))}",
            f"--policy.tags={json.dumps([contract.tag])}",
            *([f"--policy.input_features={json.dumps(inputs)}"] if inputs and not own else []),
            f"--output_dir={self.out}",
            f"--seed={self.seed}",
            *self._length,
        ]

    @property
    def done_steps(self) -> int:
        """Number of steps that the last checkpoint has behind it."""
        last = self._checkpoint
        if last is None:
            return 0
        path = last / "training_state" / "training_step.json"
        step = read_json(path, PolicyError).get("step")
        if not isinstance(step, int):
            raise PolicyError(f"{path} is damaged: it does not say how many steps are done.")
        return step

    @property
    def finished(self) -> bool:
        """True if all steps are done."""
        return self.done_steps >= self.steps

    @property
    def policy(self) -> Path:
        """Folder of the trained policy."""
        return self.out / _CHECKPOINTS / _LAST / _PRETRAINED

    @property
    def own_config(self) -> Path:
        """The configuration with the dataset's cameras, where it names others."""
        return self.out.with_name(f"{self.out.name}.yaml")

    def prepare(self) -> None:
        """Make ready for the command: remove what an interruption left, write what it reads.

        The numbers of the dataset and its statistics are checked. An interruption before the first checkpoint leaves
        what LeRobot would stumble over. And inputs of the command line do not replace those of a configuration but come
        on top, so that other cameras take a configuration.

        Raises:
            PolicyError: the folder holds something else.
            DatasetError: the dataset holds numbers, or statistics, that cannot be.
        """
        if self._checkpoint is not None:
            return
        dataset = Dataset(self.dataset)
        check_whole(dataset)
        check_training_data(dataset, named_inputs(self.config))
        if self.out.exists():
            self._clear()
        inputs = input_features(self.config, dataset.features)
        if self._renames(inputs):
            values = read_config(self.config)
            values["policy"]["input_features"] = inputs
            write_atomically(self.own_config, lambda path: path.write_text(yaml.safe_dump(values, sort_keys=False)))

    def _clear(self) -> None:
        if strangers := [path.name for path in self.out.iterdir() if path.name != _CHECKPOINTS]:
            raise PolicyError(f"{self.out} holds {strangers[0]!r} but no training to resume; choose another --out.")
        shutil.rmtree(self.out)

    def run(self, output: IO[str] | None = None) -> int:
        """Print the stock command and run it, with its data in memory.

        It computes with one thread unless ``OMP_NUM_THREADS`` says otherwise.

        Args:
            output: Where what it prints goes; to this process's own output if omitted.

        Returns:
            Its exit code.

        Raises:
            PolicyError: the output folder holds something else.
            ErIlError: another process trains there.
        """
        with work_folder(self.out):
            self.prepare()
            stock = self.command
            print(shlex.join(["OMP_NUM_THREADS=1", *stock]), file=output, flush=True)
            command = [sys.executable, "-m", IN_MEMORY, *stock[1:]]
            environment = ONE_THREAD | os.environ
            return subprocess.run(
                command, env=environment, stdout=output, stderr=output, check=False, preexec_fn=end_with_parent
            ).returncode

    def _renames(self, inputs: Mapping[str, Any]) -> bool:
        """True if the dataset has other inputs than the configuration names."""
        return bool(inputs) and inputs.keys() != named_inputs(self.config).keys()

    def _episodes(self, info: Mapping[str, Any]) -> list[int]:
        episodes = train_episodes(info)
        if self.demonstrations is not None and not 1 <= self.demonstrations <= len(episodes):
            raise DatasetError(
                f"Of {len(episodes)} training episodes, {self.demonstrations} cannot be taken to train on."
            )
        return episodes[: self.demonstrations]

    @property
    def _checkpoint(self) -> Path | None:
        """The last complete checkpoint."""
        folder = self.out / _CHECKPOINTS
        if (folder / _LAST).exists():
            return (folder / _LAST).resolve()
        # LeRobot takes the link away for a moment to move it: what it pointed at is not the newest.
        complete = sorted(folder.glob("[0-9]*"))[:-1]
        return complete[-1] if complete else None

    @property
    def _length(self) -> list[str]:
        return [f"--steps={self.steps}"]


def pretrained(path: Path) -> Path:
    """Find the policy in a folder: a pretrained policy, or the output of a training.

    Raises:
        PolicyError: there is none.
    """
    for folder in (path, path / _CHECKPOINTS / _LAST / _PRETRAINED):
        if (folder / "config.json").is_file():
            return folder
    raise PolicyError(f"No policy at {path}: neither it nor a checkpoint inside has a config.json.")


def train_episodes(info: Mapping[str, Any]) -> list[int]:
    """Read the training episodes off a dataset's splits, such as ``{"train": "0:32"}``.

    Raises:
        DatasetError: the dataset names none.
    """
    splits = info.get("splits")
    try:
        assert isinstance(splits, Mapping)
        start, stop = splits[TRAIN].split(":")
        episodes = list(range(int(start), int(stop)))
    except (AssertionError, KeyError, ValueError, AttributeError) as error:
        raise DatasetError(f"The dataset names no {TRAIN} episodes in its splits: {splits}.") from error
    if not episodes or episodes[0] < 0 or episodes[-1] >= info["total_episodes"]:
        raise DatasetError(
            f"The dataset has {info['total_episodes']} episodes; its splits take {splits[TRAIN]} of them to train on."
        )
    return episodes
