"""The style that all figures share: colours and labels, sizes, legends, and how a figure is saved."""

import functools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from er_il.support.atomic_files import write_atomically

INK, GREY, GRID = "#222222", "#767676", "#dddddd"
WINE = "#882255"  # Paul Tol's
GOOD, BAD = "#2e7d32", "#b3261e"
# Okabe and Ito's palette, which colour-blind readers can tell apart.
SKY, GREEN, PURPLE, ORANGE, RED, YELLOW, BLUE = (
    "#56B4E9", "#009E73", "#CC79A7", "#E69F00", "#D55E00", "#F0E442", "#0072B2"
)  # fmt: skip
# Of series without a colour of their own: Paul Tol's muted palette.
OTHERS = ("#332288", "#88CCEE", "#44AA99", "#117733", "#999933", "#DDCC77", "#CC6677", "#882255", "#AA4499")

DOTTED, DASHED = (0, (1, 1.2)), (0, (3, 3))
STYLE = Path(__file__).with_name("figures.mplstyle")
LEGEND_WIDTH = 2.0  # [in] of a column of a legend


@dataclass(frozen=True)
class Look:
    """Appearance of a series: its label in the legend, its colour and its line style."""

    label: str
    colour: str
    line: str | tuple[float, tuple[float, ...]] = "-"


LOOKS = {
    "joint": Look("Joint", SKY),
    "task": Look("Task", ORANGE),
    "erj": Look("ERJ", GREEN),
    "era": Look("ERA", PURPLE),
    "erx": Look("ERX", BLUE),
    "task-nearest": Look("Task (nearest)", ORANGE),
    "task-posture": Look("Task (posture)", RED),
    "task-clear": Look("Task (clear)", WINE),
    "task-mean": Look("Task (mean posture)", YELLOW),
    "task-grasp": Look("Task (grasp posture)", GREY),
    "erj-free": Look("ERJ, free", GREEN, DASHED),
    "erx-free": Look("ERX, free", BLUE, DASHED),
    "jailer": Look("JAiLeR", GREY),
    "jailer-rew": Look("JAiLeR (+rew)", INK),
    # Chunk-relative forms: the same hue, darker, and dashed where lines are drawn.
    "rel_joint": Look("Relative joint", "#1F78B4", DASHED),
    "rel_erj": Look("Relative ERJ", "#00573F", DASHED),
    "rel_era": Look("Relative ERA", "#7A3F63", DASHED),
    "rel_erx": Look("Relative ERX", "#003A5C", DASHED),
    "rel_task-nearest": Look("Relative task (nearest)", "#8A5F00", DASHED),
}


def label_of(decoder: str) -> str:
    """Label of a decoder or action space."""
    return LOOKS[decoder].label if decoder in LOOKS else decoder


def looks_of(names: Iterable[str]) -> dict[str, Look]:
    """The look of each decoder, space or other series; those without one of their own take the other colours."""
    names = list(names)
    others = iter(OTHERS * len(names))
    return {name: LOOKS.get(name) or Look(name, next(others)) for name in names}


def styled[**P](draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Decorate a function that draws a figure, so that it does so in the shared style."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with mpl.rc_context(fname=STYLE):
            figure = draw(*args, **kwargs)
            figure.draw_without_rendering()  # ticks take their sizes only now
        return figure

    return drawn


def legend(figure: Figure, *, below: bool = False) -> None:
    """Put one legend of all labelled series above or below the axes, markers last."""
    entries = {
        label: handle for axis in figure.axes for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    labels = sorted(entries, key=lambda label: isinstance(entries[label], Line2D))
    rows = math.ceil(len(labels) / max(1, int(figure.get_figwidth() / LEGEND_WIDTH)))
    place = "outside lower left" if below else "outside upper left"
    figure.legend([entries[label] for label in labels], labels, loc=place, ncols=math.ceil(len(labels) / rows))


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a picture; the folder is made, and the file is whole or absent."""
    write_atomically(path, figure.savefig)
