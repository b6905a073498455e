"""Films side by side as one animated picture, which a README shows without a player."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import av
from PIL import Image, ImageDraw, ImageFont

from er_il.report.pictures import BAD, GOOD, INK
from er_il.support.atomic_files import write_atomically

WIDTH = 440  # [px] of a film
HEADER, GAP = 30, 6  # [px] above a film for its title, and between films
TITLE_SIZE = 17  # [px]
PAUSE = 2500  # [ms] on the last picture
QUALITY = 72  # of WebP's 100


@dataclass(frozen=True)
class Panel:
    """One film: what to call it, and what came of it, shown once it is over."""

    title: str
    outcome: str
    success: bool
    film: Path


def write_animation(panels: Sequence[Panel], path: Path) -> None:
    """Write the films side by side as an animated WebP, in their own time; the shorter ones wait at their end."""
    films = [_read(panel.film) for panel in panels]
    pictures = [list(film) for film, _ in films]
    period = round(1000 / films[0][1])  # [ms]
    length = max(len(film) for film in pictures)
    frames = [_frame(panels, pictures, at) for at in range(length)]
    durations = [period] * (length - 1) + [PAUSE]
    options = {"save_all": True, "append_images": frames[1:], "duration": durations, "loop": 0, "quality": QUALITY}
    write_atomically(path, lambda partial: frames[0].save(partial, format="WEBP", **options))


def _read(film: Path) -> tuple[Iterator[Image.Image], float]:
    """A film's pictures, made smaller, and its rate [Hz]."""
    container = av.open(str(film))
    stream = container.streams.video[0]
    assert stream.average_rate is not None
    height = round(WIDTH * stream.height / stream.width)

    def pictures() -> Iterator[Image.Image]:
        with container:
            for frame in container.decode(stream):
                yield frame.to_image().resize((WIDTH, height), Image.Resampling.LANCZOS)

    return pictures(), float(stream.average_rate)


def _frame(panels: Sequence[Panel], pictures: Sequence[Sequence[Image.Image]], at: int) -> Image.Image:
    columns = math.ceil(math.sqrt(len(panels)))
    height = pictures[0][0].height + HEADER
    rows = math.ceil(len(panels) / columns)
    size = (columns * (WIDTH + GAP) - GAP, rows * (height + GAP) - GAP)
    frame = Image.new("RGB", size, "white")
    draw, font = ImageDraw.Draw(frame), ImageFont.load_default(TITLE_SIZE)
    for place, (panel, film) in enumerate(zip(panels, pictures, strict=True)):
        left, top = place % columns * (WIDTH + GAP), place // columns * (height + GAP)
        draw.text((left + 4, top + HEADER / 2), panel.title, INK, font, anchor="lm")
        frame.paste(film[min(at, len(film) - 1)], (left, top + HEADER))
        if at >= len(film) - 1:
            colour = GOOD if panel.success else BAD
            draw.text((left + WIDTH - 4, top + HEADER / 2), panel.outcome, colour, font, anchor="rm")
            box = (left, top + HEADER, left + WIDTH - 1, top + height - 1)
            draw.rectangle(box, outline=colour, width=4)
    return frame
