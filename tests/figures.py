"""What figures show, read from Matplotlib's objects, and whether their texts can be read."""

import itertools
from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import BarContainer, ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.text import Text


def bars(axis: Axes) -> dict[str, list[float]]:
    """Heights of the bars by label of the series."""
    found = [each for each in axis.containers if isinstance(each, BarContainer)]
    return {str(each.get_label()): [bar.get_height() for bar in each] for each in found}


def error_bars(axis: Axes) -> list[np.ndarray]:
    """Bounds (N, 2) of the error bars of each series."""
    found = []
    for each in axis.containers:
        if isinstance(each, ErrorbarContainer) and each.has_yerr:
            (lines,) = each.lines[2]
            found.append(np.array([segment[:, 1] for segment in lines.get_segments() if len(segment)]))
    return found


def points(axis: Axes) -> dict[str, np.ndarray]:
    """Values of the curves by label of the series."""
    found = [each for each in axis.containers if isinstance(each, ErrorbarContainer)]
    return {
        str(each.get_label()): np.asarray(each.lines[0].get_ydata(), dtype=float)
        for each in found
        if each.lines[0] is not None
    }


def legend_of(figure: Figure) -> list[str]:
    """The entries of the figure's legend."""
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def ticks(axis: Axes) -> list[str]:
    """Labels of the x axis."""
    return [label.get_text() for label in axis.get_xticklabels()]


def assert_readable(figure: Figure) -> None:
    """Every text is inside the figure, and none lies upon another."""
    figure.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in _texts(figure)]
    assert boxes
    for name, box in boxes:
        assert box.x0 >= -1 and box.y0 >= -1, name
        assert box.x1 <= figure.bbox.x1 + 1 and box.y1 <= figure.bbox.y1 + 1, name
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        width, height = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(width, height) < 1, f"{one!r} and {other!r} overlap"


def _texts(figure: Figure) -> Iterator[Text]:
    """Texts that are drawn: without those of hidden axes, and of ticks beyond an axis' limits."""
    hidden: set[Text] = set()
    for axis in figure.axes:
        for each in (axis.xaxis, axis.yaxis):
            low, high = sorted(each.get_view_interval())
            for tick in (*each.get_major_ticks(), *each.get_minor_ticks()):
                if not axis.axison or not low <= tick.get_loc() <= high:
                    hidden |= {tick.label1, tick.label2}
        if not axis.axison:
            hidden |= set(axis.findobj(Text))
    for text in figure.findobj(Text):
        if isinstance(text, Text) and text not in hidden and text.get_visible() and text.get_text().strip():
            yield text
