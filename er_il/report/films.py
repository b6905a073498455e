"""Films of rollouts: as mp4, as a strip of pictures, and side by side in one animated picture."""

import math
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont

from er_il.evaluation.recording import Picture
from er_il.report.style import BAD, GOOD, INK, save
from er_il.support.atomic_files import write_atomically

PICTURE_WIDTH = 2.6  # [in] in a strip
COLOURS = 256  # of a strip's palette
WIDTH = 440  # [px] of a film in an animation
HEADER, GAP = 30, 6  # [px] above a film for its title, and between films
TITLE_SIZE = 17  # [px]
PAUSE = 2500  # [ms] on the last picture
QUALITY = 72  # of WebP's 100


@dataclass(frozen=True)
class Panel:
    """One film in a strip or an animation: its title, its outcome, and where it lies."""

    title: str
    outcome: str
    success: bool
    film: Path


def write_film(pictures: Sequence[Picture], path: Path, rate: int) -> None:
    """Write an mp4 (H.264) at ``rate`` pictures a second; the file is whole or absent."""

    def encode(partial: Path) -> None:
        height, width = pictures[0].shape[:2]
        with av.open(str(partial), "w") as container:
            stream = container.add_stream("libx264", rate=rate, options={"crf": "23", "preset": "veryfast"})
            stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            for picture in pictures:
                container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
            container.mux(stream.encode())

    write_atomically(path, encode)


def moments[P](pictures: Sequence[P], count: int) -> list[P]:
    """Pick pictures evenly from the first to the last."""
    return [pictures[i] for i in np.linspace(0, len(pictures) - 1, count).round().astype(int)]


def strip_figure(panels: Sequence[Panel], count: int) -> Figure:
    """One film a row, each by ``count`` pictures."""
    rows = [moments(_read(panel.film)[0], count) for panel in panels]
    width, height = rows[0][0].size
    size = PICTURE_WIDTH * count, (PICTURE_WIDTH * height / width + 0.42) * len(rows)
    figure = Figure(figsize=size, dpi=110)
    for panel, row, axes in zip(panels, rows, figure.subplots(len(rows), count, squeeze=False), strict=True):
        for picture, axis in zip(row, axes, strict=True):
            axis.imshow(picture)
            axis.set_axis_off()
        axes[0].set_title(panel.title, loc="left", fontsize=11, color=INK, fontweight="bold")
        axes[-1].set_title(panel.outcome, loc="right", fontsize=11, color=GOOD if panel.success else BAD)
    top = 1 - 0.3 / figure.get_figheight()
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=top, wspace=0.02, hspace=0.18)
    return figure


def write_strip(panels: Sequence[Panel], count: int, path: Path) -> None:
    """Write a strip as a PNG with a palette, a third of the space of one without."""

    def write(partial: Path) -> None:
        save(strip_figure(panels, count), partial)
        Image.open(partial).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(partial, optimize=True)

    write_atomically(path, write)


def write_animation(panels: Sequence[Panel], path: Path) -> None:
    """Write films side by side as an animated WebP, in their own time; the shorter ones wait at their end."""
    films, rates = zip(*(_read(panel.film, WIDTH) for panel in panels), strict=True)
    length = max(len(film) for film in films)
    frames = [_frame(panels, films, at) for at in range(length)]
    durations = [round(1000 / rates[0])] * (length - 1) + [PAUSE]
    options = {"save_all": True, "append_images": frames[1:], "duration": durations, "loop": 0, "quality": QUALITY}
    write_atomically(path, lambda partial: frames[0].save(partial, format="WEBP", **options))


def _read(film: Path, width: int | None = None) -> tuple[list[Image.Image], float]:
    """A film's pictures, resized to ``width`` [px] if given, and its rate [Hz]."""
    with closing(av.open(str(film))) as container:
        stream = container.streams.video[0]
        assert stream.average_rate is not None
        pictures = [frame.to_image() for frame in container.decode(stream)]
        if width:
            size = width, round(width * stream.height / stream.width)
            pictures = [picture.resize(size, Image.Resampling.LANCZOS) for picture in pictures]
        return pictures, float(stream.average_rate)


def _frame(panels: Sequence[Panel], films: Sequence[Sequence[Image.Image]], at: int) -> Image.Image:
    columns = math.ceil(math.sqrt(len(panels)))
    height = films[0][0].height + HEADER
    rows = math.ceil(len(panels) / columns)
    frame = Image.new("RGB", (columns * (WIDTH + GAP) - GAP, rows * (height + GAP) - GAP), "white")
    draw, font = ImageDraw.Draw(frame), ImageFont.load_default(TITLE_SIZE)
    for place, (panel, film) in enumerate(zip(panels, films, strict=True)):
        left, top = place % columns * (WIDTH + GAP), place // columns * (height + GAP)
        draw.text((left + 4, top + HEADER / 2), panel.title, INK, font, anchor="lm")
        frame.paste(film[min(at, len(film) - 1)], (left, top + HEADER))
        if at >= len(film) - 1:
            colour = GOOD if panel.success else BAD
            draw.text((left + WIDTH - 4, top + HEADER / 2), panel.outcome, colour, font, anchor="rm")
            draw.rectangle((left, top + HEADER, left + WIDTH - 1, top + height - 1), outline=colour, width=4)
    return frame
