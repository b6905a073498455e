"""The trace of one episode: what the arm was told at each control step, what became of it, and what it saw."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from er_il.support.atomic_files import write_arrays
from er_il.support.errors import DatasetError, ShapeError

Array = NDArray[np.float64]

SUFFIX = ".npz"
TRACE_VERSION = 1
_ARRAYS = ("q", "gripper", "action", "command", "environment_state", "status")
_TEXTS = ("task", "seed", "period", "label", "outcome", "spec", "environment_state_names")
_IMAGES = "images/"


@dataclass(frozen=True, eq=False)
class Trace:
    """One episode of T control steps. Row t holds what was measured before action t, and action t.

    Raises:
        ShapeError: the arrays do not fit each other.
    """

    task: str
    seed: int  # reset seed of the environment: brings the same world back
    period: float  # [s] between rows
    label: str  # who acted: a decoder such as ``task-nearest``, or ``demo``
    outcome: str  # ``success``, or what failed; "" where unknown
    spec: Mapping[str, Any]  # of the action space (ActionSpace.spec)
    q: Array  # (T, n) [rad] measured
    gripper: Array  # (T,) measured opening in [0, 1]
    action: Array  # (T, dim) as the policy or the recording gave it
    command: Array  # (T, n) [rad] decoded action, as sent to the arm
    status: tuple[str, ...]  # T statuses of decoding (er_il.Status)
    environment_state: Array  # (T, k) object poses
    environment_state_names: tuple[str, ...]
    images: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)  # camera -> (T, height, width, 3) RGB

    def __post_init__(self) -> None:
        steps, n, dim = len(self.q), len(self.spec["arm"]["joints"]), len(self.spec["names"])
        expected = {
            "q": (steps, n),
            "gripper": (steps,),
            "action": (steps, dim),
            "command": (steps, n),
            "environment_state": (steps, len(self.environment_state_names)),
        }
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise ShapeError(f"Trace.{name}", getattr(self, name).shape, str(shape))
        if len(self.status) != steps:
            raise ShapeError("Trace.status", (len(self.status),), f"({steps},)")
        for camera, frames in self.images.items():
            if frames.ndim != 4 or len(frames) != steps or frames.shape[3] != 3:
                raise ShapeError(f"Trace.images[{camera!r}]", frames.shape, f"({steps}, height, width, 3)")

    def __len__(self) -> int:
        return len(self.q)

    @property
    def times(self) -> Array:
        """(T,) [s] since the start of the episode."""
        return np.arange(len(self), dtype=np.float64) * self.period

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the n arm joints."""
        return tuple(self.spec["arm"]["joints"])

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the action's dimensions."""
        return tuple(self.spec["names"])

    def save(self, path: Path) -> None:
        """Write a compressed ``.npz``; equal traces give equal files, and no file is ever half-written."""
        text = json.dumps({"version": TRACE_VERSION} | {name: getattr(self, name) for name in _TEXTS}, sort_keys=True)
        arrays = {name: np.asarray(getattr(self, name)) for name in _ARRAYS}
        images = {_IMAGES + camera: frames for camera, frames in self.images.items()}
        write_arrays(path, {"meta": np.array(text)} | arrays | images)

    @classmethod
    def load(cls, path: Path) -> "Trace":
        """Read what :meth:`save` wrote.

        Raises:
            DatasetError: the file is missing or no trace.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                data = dict(file)
            meta = json.loads(str(data.pop("meta")))
            if meta.pop("version") != TRACE_VERSION:
                raise DatasetError(f"{path} was written by another version of er_il.")
            images = {key.removeprefix(_IMAGES): data.pop(key) for key in list(data) if key.startswith(_IMAGES)}
            data["status"] = tuple(data["status"].tolist())
            meta["environment_state_names"] = tuple(meta["environment_state_names"])
            return cls(**meta, **data, images=images)
        except FileNotFoundError as error:
            raise DatasetError(f"There is no trace {path}.") from error
        except (BadZipFile, EOFError, KeyError, TypeError, ValueError) as error:
            raise DatasetError(f"{path} is not a trace of an episode.") from error
