"""A benchmark's tables in Markdown, rendered from its report alone."""

from collections.abc import Mapping, Sequence
from typing import Any

from er_il.evaluation.results import REFERENCE
from er_il.report.markdown import markdown_table
from er_il.support.counts import tally

Report = Mapping[str, Any]  # of results.json
Cell = Mapping[str, Any]

NONE = "–"


def compact_table(report: Report, decoders: Sequence[str] = ()) -> str:
    """Successes with exact 95 % intervals, a row a task and a column a decoder.

    Args:
        report: What was counted.
        decoders: Columns; the grid's decoders, without the sceptics' ones, if empty.
    """
    grid = report["meta"]["grid"]
    columns, counts = decoders or grid["decoders"], grid["demonstrations"]
    several = len(counts) > 1
    by_key = {(cell["task"], cell["demonstrations"], cell["decoder"]): cell for cell in report["cells"]}
    rows = [
        [f"`{task}`", *([str(count)] * several), *(_success(by_key.get((task, count, name))) for name in columns)]
        for task in grid["tasks"]
        for count in counts
    ]
    return markdown_table(["Task", *["Demonstrations"] * several, *columns], rows)


def full_table(report: Report) -> str:
    """Everything that was counted, a row a cell."""
    cells = report["cells"]
    several = len(report["meta"]["grid"]["demonstrations"]) > 1
    paired, elbows = (any(key in cell for cell in cells) for key in (f"difference_to_{REFERENCE}", "elbow_error"))
    headings = ["Task", "Decoder", *["Demonstrations"] * several, "Success", "95 % interval", "By training seed"]
    headings += [f"Minus {REFERENCE}, paired"] * paired + ["Failures", "Invalid actions", "Decode p50 / p99"]
    headings += ["Largest step"] + ["Elbow off by"] * elbows
    rows = []
    for cell in cells:
        row = [f"`{cell['task']}`", cell["decoder"], *[str(cell["demonstrations"])] * several]
        row += [f"**{cell['successes']}/{cell['episodes']}**", percentages(cell["interval"])]
        row.append(", ".join(str(each["successes"]) for each in cell["per_seed"]))
        row += [difference(cell) or NONE] * paired
        row.append(tally(cell["failures"]) or NONE)
        row += [f"{cell['invalid_rate']:.1%}", f"{cell['decode_p50_ms']:.2f} / {cell['decode_p99_ms']:.2f} ms"]
        row.append(f"{cell['max_joint_step']:.3f} rad")
        row += [f"{100 * cell['elbow_error']:.1f} cm" if "elbow_error" in cell else NONE] * elbows
        rows.append(row)
    return markdown_table(headings, rows)


def percentages(interval: Sequence[float]) -> str:
    """An interval of rates."""
    low, high = interval
    return f"{low:.1%} – {high:.1%}"


def difference(cell: Cell) -> str:
    """The paired difference to the reference in percentage points, with its interval; "" if there is none."""
    if f"difference_to_{REFERENCE}" not in cell:
        return ""
    paired = cell[f"difference_to_{REFERENCE}"]
    low, high = paired["interval"]
    return f"{100 * paired['difference']:+.1f} ({100 * low:+.1f} to {100 * high:+.1f})"


def _success(cell: Cell | None) -> str:
    return NONE if cell is None else f"**{cell['successes']}/{cell['episodes']}** ({percentages(cell['interval'])})"
