"""Tables of results in Markdown and in the terminal, rendered from the results' JSON alone."""

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import Any

from rich.markup import escape
from rich.table import Table

from er_il.evaluation.results import REFERENCE
from er_il.evaluation.statistics import exact_interval
from er_il.support.counts import tally

Row = Mapping[str, Any]
Columns = Mapping[str, Callable[[Any], str]]  # heading -> text of a row's cell

NONE = "–"
DIFFERENCE = f"difference_to_{REFERENCE}"


def markdown_table(rows: Sequence[Any], columns: Columns) -> str:
    """Rows as a Markdown table."""
    lines = [list(columns), ["---"] * len(columns), *([cell(row) for cell in columns.values()] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def terminal_table(rows: Sequence[Any], columns: Columns) -> Table:
    """Rows as a table for the terminal, without Markdown's marks."""
    table = Table(box=None, header_style="bold")
    for heading in columns:
        table.add_column(heading.replace("`", ""))
    for row in rows:
        table.add_row(*(escape(cell(row).replace("**", "").replace("`", "")) for cell in columns.values()))
    return table


def rates(interval: Sequence[float]) -> str:
    """An interval of rates as percentages."""
    low, high = interval
    return f"{low:.1%} – {high:.1%}"


def joined(names: Sequence[str]) -> str:
    """Name of a choice of joints: ``panda_joint1``, or ``joint1 + joint3``."""
    return " + ".join(names)


def _leader(cell: Row) -> str:
    starts, dropped = cell["leader"]["starts"], cell["leader"]["dropped"]
    return ", ".join(filter(None, [f"{starts - sum(dropped.values())}/{starts}", tally(dropped)]))


def _difference(cell: Row) -> str:
    """Paired difference to the reference in percentage points, with its interval."""
    low, high = cell[DIFFERENCE]["interval"]
    return f"{100 * cell[DIFFERENCE]['difference']:+.1f} ({100 * low:+.1f} to {100 * high:+.1f})"


# Heading, key of a cell without which there is nothing to show, and text.
_SUCCESS: tuple[tuple[str, str, Callable[[Row], str]], ...] = (
    ("Task", "task", lambda cell: f"`{cell['task']}`"),
    ("Leader", "leader", _leader),
    ("Decoder", "decoder", lambda cell: cell["decoder"]),
    ("Demonstrations", "demonstrations", lambda cell: str(cell["demonstrations"])),
    ("Success", "successes", lambda cell: f"**{cell['successes']}/{cell['episodes']}**"),
    ("95 % interval", "interval", lambda cell: rates(cell["interval"])),
    ("By training seed", "per_seed", lambda cell: ", ".join(str(each["successes"]) for each in cell["per_seed"])),
    (f"Paired difference to {REFERENCE}", DIFFERENCE, _difference),
    ("Failures", "failures", lambda cell: tally(cell["failures"]) or NONE),
    ("Invalid actions", "invalid_rate", lambda cell: f"{cell['invalid_rate']:.1%}"),
    ("Decode time p50 / p99", "decode_p50_ms", lambda c: f"{c['decode_p50_ms']:.2f} / {c['decode_p99_ms']:.2f} ms"),
    ("Max. joint deviation", "max_joint_deviation", lambda cell: f"{cell['max_joint_deviation']:.3f} rad"),
    ("Max. joint step", "max_joint_step", lambda cell: f"{cell['max_joint_step']:.3f} rad"),
    ("Mean elbow error", "elbow_error", lambda cell: f"{100 * cell['elbow_error']:.1f} cm"),
)


def success_columns(cells: Sequence[Row]) -> dict[str, Callable[[Row], str]]:
    """Columns of all that the cells have; the number of demonstrations only where it varies."""
    constant = {"demonstrations"} if len({cell.get("demonstrations") for cell in cells}) == 1 else set()
    shown = [each for each in _SUCCESS if each[1] not in constant and any(each[1] in cell for cell in cells)]

    def optional(key: str, text: Callable[[Row], str]) -> Callable[[Row], str]:
        return lambda cell: text(cell) if key in cell else NONE

    return {heading: optional(key, text) for heading, key, text in shown}


def success_table(cells: Sequence[Row]) -> str:
    """Reported rollouts or replays, a row per cell."""
    return markdown_table(cells, success_columns(cells))


def compact_table(report: Row, decoders: Sequence[str] = ()) -> str:
    """Successes with exact 95 % intervals, a row per task (and number of demonstrations) and a column per decoder.

    Args:
        report: Results of a grid.
        decoders: Columns; the grid's decoders without the posture baselines if empty.
    """
    grid = report["meta"]["grid"]
    cells = {(cell["task"], cell["demonstrations"], cell["decoder"]): cell for cell in report["cells"]}

    def success(name: str) -> Callable[[tuple[str, int]], str]:
        def text(row: tuple[str, int]) -> str:
            cell = cells.get((*row, name))
            return f"**{cell['successes']}/{cell['episodes']}** ({rates(cell['interval'])})" if cell else NONE

        return text

    columns: dict[str, Callable[[Any], str]] = {"Task": lambda row: f"`{row[0]}`"}
    if len(grid["demonstrations"]) > 1:
        columns["Demonstrations"] = lambda row: str(row[1])
    columns |= {name: success(name) for name in decoders or grid["decoders"]}
    return markdown_table([(task, count) for task in grid["tasks"] for count in grid["demonstrations"]], columns)


def round_trips_table(report: Row) -> str:
    """Round-trip accuracy of each arm and space, with the causes of misses."""
    border = report["meta"]["ill_conditioned"]
    key = lambda row: (row["arm"], row["space"])  # noqa: E731
    rows = [{row["seed_error"]: row for row in group} for _, group in groupby(report["round_trips"], key=key)]
    errors = list(rows[0])
    first = errors[0]

    def accuracy(row: Row) -> str:
        low, high = exact_interval(row["exact"], row["samples"])
        return f"**{row['exact'] / row['samples']:.1%}** ({rates((low, high))})"

    def well_conditioned(row: Row) -> str:
        best, count = row["best_conditioned_miss"], row["samples"] - row["ill_conditioned_samples"]
        return f"all {count}" if best is None or best < border else f"not all {count}"

    def causes(row: Row) -> str:
        return ", ".join(f"{cause} {count}" for cause, count in row["causes"].items() if count) or NONE

    return markdown_table(
        rows,
        {
            "Arm": lambda row: row[first]["arm"],
            "Joints": lambda row: str(row[first]["joints"]),
            "Space": lambda row: row[first]["space"],
            "Redundancy": lambda row: ", ".join(row[first]["commands"]),
            **{
                f"Round-trip accuracy, seed ± {error:g} rad": lambda row, error=error: accuracy(row[error])
                for error in errors
            },
            f"Causes of misses, seed ± {first:g} rad": lambda row: causes(row[first]),
            "Exact away from singularities": lambda row: well_conditioned(row[first]),
        },
    )


# Of a study of deltas, a row per space.
DELTA_COLUMNS: Columns = {
    "Space": lambda row: row["space"],
    "Steps (longest demonstration)": lambda row: f"{row['steps']} ({row['longest']})",
    "Invalid actions": lambda row: str(row["invalid"]),
    "Max. joint error": lambda row: f"{row['joints']:.0e} rad",
    "Max. end-effector error": lambda row: f"{1e3 * row['position']:.0e} mm, {row['rotation']:.0e} rad",
}


def drift_columns(report: Row) -> dict[str, Callable[[Row], str]]:
    """Columns of a report of the elbow on a circle, a row per solver."""
    names = {"lerobot": "LeRobot's IK", "task": "er_il, task space", "erj": "er_il, ERJ", "era": "er_il, ERA"}
    return {
        "Solver": lambda drive: names[drive["solver"]],
        **{
            f"Elbow drift after lap {lap + 1}": lambda drive, lap=lap: f"{100 * drive['drift'][lap]:.1f} cm"
            for lap in range(report["meta"]["laps"])
        },
        "Max. end-effector error": lambda drive: f"{1e3 * drive['max_position_error']:.2f} mm",
    }


def drift_table(report: Row) -> str:
    """Elbow drift of each solver on the circle."""
    return markdown_table(report["drives"], drift_columns(report))


def deltas_table(report: Row) -> str:
    """Accumulated error of delta actions along demonstrations."""
    return markdown_table(report["drifts"], DELTA_COLUMNS)


def training_time_table(report: Row) -> str:
    """Time per training step of LeRobot's command and of er_il's."""

    def total(row: Row) -> float:
        return row["load_s"] + row["update_s"]

    return markdown_table(
        report["training_times"],
        {
            "Inputs": lambda row: f"{row['inputs']}, batch {row['batch']}",
            "Command": lambda row: row["command"],
            "Load a batch": lambda row: f"{1e3 * row['load_s']:.0f} ms",
            "Update the policy": lambda row: f"{1e3 * row['update_s']:.0f} ms",
            "Share of loading": lambda row: f"{row['load_s'] / total(row):.0%}",
            "Steps per second": lambda row: f"{1 / total(row):.1f}",
        },
    )
