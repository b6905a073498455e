"""Films and picture strips of rollouts."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from matplotlib.figure import Figure

from er_il.evaluation.recording import Picture
from er_il.support.atomic_files import write_atomically

INK = "#222222"
GOOD, BAD = "#2e7d32", "#b3261e"


@dataclass(frozen=True)
class Row:
    """One rollout in a strip: what to call it, what came of it, and its pictures in time order."""

    title: str
    outcome: str
    success: bool
    pictures: Sequence[Picture]


def write_film(pictures: Sequence[Picture], path: Path, rate: int) -> None:
    """Write an mp4 (H.264) at ``rate`` pictures a second; the file is whole or absent."""
    write_atomically(path, lambda partial: _encode(pictures, partial, rate))


def _encode(pictures: Sequence[Picture], path: Path, rate: int) -> None:
    height, width = pictures[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=rate, options={"crf": "23", "preset": "veryfast"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def moments(pictures: Sequence[Picture], count: int) -> list[Picture]:
    """Pick pictures evenly from the first to the last."""
    return [pictures[i] for i in np.linspace(0, len(pictures) - 1, count).round().astype(int)]


def write_strip(rows: Sequence[Row], path: Path) -> None:
    """Write a PNG with one rollout a row; all rows have equally many pictures."""
    height, width = rows[0].pictures[0].shape[:2]
    cell = 2.6  # [inch] width of a picture
    columns = len(rows[0].pictures)
    figure = Figure(figsize=(cell * columns, (cell * height / width + 0.42) * len(rows)), dpi=110)
    axes = figure.subplots(len(rows), columns, squeeze=False)
    for row, line in zip(rows, axes, strict=True):
        for picture, axis in zip(row.pictures, line, strict=True):
            axis.imshow(picture)
            axis.set_axis_off()
        line[0].set_title(row.title, loc="left", fontsize=11, color=INK, fontweight="bold")
        line[-1].set_title(row.outcome, loc="right", fontsize=11, color=GOOD if row.success else BAD)
    top = 1 - 0.3 / figure.get_figheight()
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=top, wspace=0.02, hspace=0.18)
    figure.savefig(path)
