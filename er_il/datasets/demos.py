"""Demonstrations: the scripted leader plays a task, the follower mirrors it, and what happened is kept."""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

from er_il.datasets.disturbance import disturbances
from er_il.datasets.recipe import Recipe
from er_il.envs.protocol import BEYOND_SUCCESS, demonstrable_env, gripper_columns
from er_il.envs.tasks import task_id
from er_il.support.atomic_files import write_arrays
from er_il.support.counts import tally
from er_il.support.errors import DatasetError, PlanError
from er_il.support.workers import StatefulWorkers

Floats = NDArray[np.float32]

HOPELESS = 10  # give up once this many more demos have failed than succeeded

_IMAGES = "images/"
_PUSHES = 1  # tells the random pushes from the numbers of the world (the seed itself) and of the leader (2)


@dataclass(frozen=True, eq=False)
class Demo:
    """A successful demonstration of T control steps. Row t: what was seen, then what the leader did."""

    seed: int  # resets the environment to the same world, and the leader to the same plan
    joints: Floats  # (T, n + 1) leader's joint positions [rad] and gripper opening, as sent; of each arm in turn
    state: Floats  # (T, s) the follower's ``agent_pos``
    environment_state: Floats  # (T, k) object poses
    images: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)  # camera -> (T, size, size, 3)

    def __len__(self) -> int:
        return len(self.joints)

    @classmethod
    def of_episode(cls, seed: int, joints: Sequence[Any], seen: Sequence[Mapping[str, Any]]) -> "Demo":
        """Put a demonstration together from what was sent, and the environment's observations, at each step."""
        cameras = seen[0].get("pixels", {})
        return cls(
            seed=seed,
            joints=np.stack(joints).astype(np.float32),
            state=_stack(seen, "agent_pos"),
            environment_state=_stack(seen, "environment_state"),
            images={camera: np.stack([each["pixels"][camera] for each in seen]) for camera in cameras},
        )

    def save(self, path: Path) -> None:
        """Write the demo; the file is whole or absent."""
        arrays: dict[str, Any] = {
            name: getattr(self, name) for name in ("seed", "joints", "state", "environment_state")
        }
        images: dict[str, Any] = {_IMAGES + camera: frames for camera, frames in self.images.items()}
        write_arrays(path, arrays | images)

    @classmethod
    def load(cls, path: Path) -> "Demo":
        """Read what :meth:`save` wrote."""
        with np.load(path, allow_pickle=False) as file:
            data = dict(file)
        images = {key.removeprefix(_IMAGES): data.pop(key) for key in list(data) if key.startswith(_IMAGES)}
        return cls(seed=int(data.pop("seed")), images=images, **data)


def make_world(recipe: Recipe) -> gymnasium.Env[Any, Any]:
    """Make the recipe's environment, joint-level.

    Raises:
        UnknownNameError: there is no such task, arm or camera.
        RandomisationError: a range of the recipe is none.
        DatasetError: the environment does not take the recipe's randomisation, or cannot render.
    """
    try:
        return gymnasium.make(task_id(recipe.task), **recipe.environment)
    except TypeError as error:
        raise DatasetError(f"The task {recipe.task} does not take this recipe: {error}") from error


def record_demo(world: gymnasium.Env[Any, Any], seed: int, disturbance: float = 0.0) -> Demo | str:
    """Play one demonstration, with a disturbance [rad] of the follower. Returns it, or why it is dropped.

    It goes on to the leader's end, beyond the moment of success: from a demonstration that breaks off
    there, a policy learns to stop just short of it.
    """
    observation, info = world.reset(seed=seed, options={BEYOND_SUCCESS: True})
    rows: list[tuple[Any, Floats]] = []
    try:
        inner = demonstrable_env(world)
        script = np.array(list(inner.leader(seed)))
        rng = np.random.default_rng([seed, _PUSHES])
        pushes = disturbances(script, gripper_columns(inner), disturbance, 1 / world.metadata["render_fps"], rng)
        for target, push in zip(script, pushes, strict=True):
            rows.append((observation, target.astype(np.float32)))
            observation, _, terminated, truncated, info = world.step((target + push).astype(np.float32))
            if truncated or (terminated and not info["is_success"]):
                break
    except PlanError:
        return "no plan"
    if not info["is_success"]:
        return info["failure"] or "unfinished"
    return Demo.of_episode(seed, [row[1] for row in rows], [row[0] for row in rows])


Record = Callable[[int], Demo | str]  # the demonstration of a seed, or why it is dropped


class Demonstrator(Protocol):
    """Who demonstrates. It travels to worker processes."""

    def starting(self, recipe: Recipe) -> Record:
        """Make ready to record a recipe's demonstrations."""
        ...


@dataclass(frozen=True)
class Leader:
    """The task's scripted leader."""

    def starting(self, recipe: Recipe) -> Record:
        return partial(record_demo, make_world(recipe), disturbance=recipe.disturbance)


LEADER = Leader()


def collect(
    recipe: Recipe, folder: Path, workers: int, demonstrator: Demonstrator = LEADER
) -> Iterator[tuple[int, str]]:
    """Record demos in worker processes until the recipe has its episodes.

    Finished demos are stored in ``folder`` (see :func:`demo_path`), and found there again by the next
    call, so an interruption costs at most the demos under way. Which demos make up the dataset
    depends on the recipe alone, not on the number of workers.

    Yields:
        The seed of each demo in turn, and why it was dropped ("" if it was kept).

    Raises:
        DatasetError: most demos fail, or a worker died.
    """
    seeds, pending = recipe.demo_seeds(), deque()
    kept, dropped = 0, Counter[str]()
    with StatefulWorkers(workers, partial(_Recorder, recipe, folder, demonstrator)) as pool:
        while kept < recipe.episodes:
            while len(pending) < recipe.episodes - kept:
                seed = next(seeds)
                pending.append((seed, pool.submit(_Recorder.record, seed)))
            seed, result = pending.popleft()
            try:
                reason = result()
            except BrokenProcessPool as error:
                raise DatasetError("A worker process died, perhaps out of memory. The same command resumes.") from error
            if reason:
                dropped[reason] += 1
            else:
                kept += 1
            if dropped.total() >= kept + HOPELESS:
                who = f"the agent {recipe.agent}" if recipe.agent else "the leader"
                raise DatasetError(
                    f"{dropped.total()} of the first {kept + dropped.total()} demos failed ({tally(dropped)}): "
                    f"{who} cannot do {recipe.task} like this. Look at the recipe's randomisation."
                )
            yield seed, reason


def demo_path(folder: Path, seed: int) -> Path:
    """Path at which :func:`collect` stores a demo."""
    return folder / f"{seed}.npz"


@dataclass
class _Recorder:
    """State of a worker between demos."""

    recipe: Recipe
    folder: Path
    demonstrator: Demonstrator
    started: Record | None = None

    def record(self, seed: int) -> str:
        path = demo_path(self.folder, seed)
        if path.exists():
            return ""
        self.started = self.started or self.demonstrator.starting(self.recipe)
        outcome = self.started(seed)
        if isinstance(outcome, str):
            return outcome
        outcome.save(path)
        return ""


def _stack(observations: Sequence[Any], key: str) -> Floats:
    return np.stack([each[key] for each in observations]).astype(np.float32)
