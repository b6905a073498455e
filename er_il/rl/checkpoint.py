"""Checkpoints of a training: networks, optimizers, transitions and random states, from which it goes on.

Tensors are read as weights alone and arrays without pickle: nothing in a checkpoint is executed.
"""

import json
import pickle
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.buffers import ReplayBuffer

from er_il.support.atomic_files import atomic_folder
from er_il.support.errors import PolicyError
from er_il.support.json_files import read_json

CHECKPOINTS, LAST = "checkpoints", "last"
POLICY, STATE = "pretrained_model", "training_state"  # in a checkpoint, named as LeRobot names them
_PROGRESS = "progress.json"
_SIZES = ("pos", "full")
_DAMAGES = (OSError, RuntimeError, KeyError, ValueError, TypeError, EOFError, BadZipFile, pickle.UnpicklingError)
_FLAGS = ("actions", "rewards", "dones", "timeouts")


def save_state(folder: Path, learners: Mapping[str, SAC], progress: Mapping[str, Any]) -> None:
    """Write the state of a training into a new folder.

    Args:
        folder: Where.
        learners: What learns, by name.
        progress: What else is to be known, as JSON.
    """
    folder.mkdir(parents=True)
    for name, learner in learners.items():
        torch.save(_tensors(learner), folder / f"{name}.pt")
        with (folder / f"{name}.npz").open("wb") as file:
            np.savez(file, allow_pickle=False, **_transitions(learner.replay_buffer))
    generators = {"numpy": np.random.get_state(legacy=False)}  # noqa: NPY002  SAC draws batches from it
    generators |= {name: learner.action_space.np_random.bit_generator.state for name, learner in learners.items()}
    torch.save({"torch": torch.get_rng_state()}, folder / "random.pt")
    counts = {name: {"timesteps": each.num_timesteps, "updates": each._n_updates} for name, each in learners.items()}
    state = {"progress": dict(progress), "counts": counts, "generators": generators}
    (folder / _PROGRESS).write_text(json.dumps(state, default=np.ndarray.tolist))


def load_state(folder: Path, learners: Mapping[str, SAC]) -> dict[str, Any]:
    """Bring learners into the state that :func:`save_state` wrote; return the progress.

    Raises:
        PolicyError: a file is missing or damaged.
    """
    try:
        state = read_json(folder / _PROGRESS, PolicyError)
        for name, learner in learners.items():
            _restore(learner, torch.load(folder / f"{name}.pt", learner.device, weights_only=True))
            with np.load(folder / f"{name}.npz", allow_pickle=False) as arrays:
                _refill(learner.replay_buffer, arrays)
            learner.num_timesteps = state["counts"][name]["timesteps"]
            learner._n_updates = state["counts"][name]["updates"]
            learner.action_space.np_random.bit_generator.state = state["generators"][name]
        torch.set_rng_state(torch.load(folder / "random.pt", weights_only=True)["torch"])
        np.random.set_state(state["generators"]["numpy"])  # noqa: NPY002
    except PolicyError:
        raise
    except _DAMAGES as error:
        said = " ".join(str(error).split())
        raise PolicyError(f"The checkpoint {folder} is damaged: {said}. Delete it, or choose another --out.") from error
    return state["progress"]


def _tensors(learner: SAC) -> dict[str, Any]:
    assert learner.log_ent_coef is not None
    return {"parameters": learner.get_parameters(), "temperature": learner.log_ent_coef.detach()}


def _restore(learner: SAC, tensors: Mapping[str, Any]) -> None:
    assert learner.log_ent_coef is not None
    learner.set_parameters(dict(tensors["parameters"]), exact_match=True, device=learner.device)
    with torch.no_grad():
        learner.log_ent_coef.copy_(tensors["temperature"])


def _transitions(buffer: ReplayBuffer | None) -> dict[str, Any]:
    assert buffer is not None
    size = buffer.size()
    return {name: array[:size] for name, array in _arrays(buffer)} | {name: getattr(buffer, name) for name in _SIZES}


def _refill(buffer: ReplayBuffer | None, arrays: Mapping[str, Any]) -> None:
    assert buffer is not None
    for name, array in _arrays(buffer):
        kept = arrays[name]
        array[: len(kept)] = kept
    buffer.pos, buffer.full = int(arrays["pos"]), bool(arrays["full"])


def _arrays(buffer: ReplayBuffer) -> Iterator[tuple[str, Any]]:
    """The arrays of a buffer by name; those of a Dict observation by its keys."""
    for name in ("observations", "next_observations"):
        found = getattr(buffer, name)
        if isinstance(found, dict):
            yield from ((f"{name}.{key}", each) for key, each in found.items())
        else:
            yield name, found
    yield from ((name, getattr(buffer, name)) for name in _FLAGS)


def write_checkpoint(out: Path, steps: int, write: Any) -> Path:
    """Let ``write`` fill the checkpoint of so many steps in a training's folder; remove the ones before."""
    folder = out / CHECKPOINTS / f"{steps:09d}"
    with atomic_folder(folder) as partial:
        write(partial)
    link = folder.with_name(f"{LAST}.partial")
    link.unlink(missing_ok=True)
    link.symlink_to(folder.name)
    link.rename(folder.with_name(LAST))
    for older in _complete(out)[:-1]:
        shutil.rmtree(older)
    return folder


def last_checkpoint(out: Path) -> Path | None:
    """The checkpoint of the most steps in a training's folder."""
    complete = _complete(out)
    return complete[-1] if complete else None


def _complete(out: Path) -> list[Path]:
    return sorted(path for path in (out / CHECKPOINTS).glob("[0-9]*") if path.name.isdigit())
