"""Re-encoding as a user asks for it: any LeRobot dataset by name, with or without a specification."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from er_il.datasets.assembled import Assembled
from er_il.datasets.column_source import ColumnSource
from er_il.datasets.dataset import Dataset
from er_il.datasets.described import read_layout
from er_il.datasets.history import SPECIFICATION, read_history
from er_il.datasets.hub import find_dataset
from er_il.datasets.integrity import check_whole
from er_il.datasets.number_checks import check_numbers
from er_il.datasets.schema import IMAGES, SOURCE, STATE
from er_il.datasets.weights import WeightsFile
from er_il.datasets.wiring import Wiring
from er_il.spaces.chunk import CHUNK, commands_of
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout
from er_il.spaces.registry import split_name
from er_il.spaces.relative import RelativeActions
from er_il.spaces.spec import ACTION
from er_il.support.atomic_files import check_absent, check_outside, check_writable


@dataclass(frozen=True)
class Reencoded:
    """A dataset that was written."""

    layout: Layout  # of its actions
    statuses: Counter[str]  # decoded commands by er_il.Status; empty if nothing had to be decoded
    notes: tuple[str, ...]  # what its user should know, a sentence or more each


def reencode(
    source: str,
    target: Path,
    kind: str,
    *,
    rotation: str,
    wirings: Sequence[Wiring],
    weights: WeightsFile | None = None,
    keep: bool,
    repo_id: str = "",
    chunk: int = CHUNK,
    on_progress: Callable[[int, int], object],
) -> Reencoded:
    """Write a dataset again with its actions in another action space.

    Where the source is encoded, joint space is reached through the decoder, and other spaces from
    the joint vectors that it kept, or through the decoder if it kept none.

    Args:
        source: Folder, or repository id.
        target: Folder that does not exist.
        kind: See :func:`er_il.spaces.make_action_space`.
        rotation: ``quat``, ``rot6d`` or ``rot6d_rows``.
        wirings: The arms of a dataset that does not know them.
        weights: Of ERX; those of the arms if omitted.
        keep: Keep the joint vectors and what else the source has as actions, where no policy reads them.
        repo_id: Where the target will be on the hub, for its card.
        chunk: Number of actions of a chunk, in a chunk-relative space.
        on_progress: Called with the number of frames done, and their total.

    Raises:
        ErIlError: the dataset, the arms or the space do not fit.
        FileExistsError: the target exists.
    """
    split_name(kind)  # raises if there is none
    dataset = Dataset(find_dataset(source))
    check_whole(dataset)
    dataset, known = read_layout(dataset, wirings)
    layout = known.in_space(kind, rotation, weights.of(known.arms) if weights else {}, chunk)
    if layout.chunk:
        RelativeActions(layout, dataset.names(STATE))  # raises unless the state measures what they count from
    encoded = dataset.specified and commands_of(dataset.spec["space"]) != JOINT
    decode = encoded and (commands_of(kind) == JOINT or dataset.joints_column(layout) is None)
    check_absent(target)
    check_outside(target, dataset.root)
    check_writable(target)
    check_numbers(dataset, layout if not encoded else dataset.layout)
    from er_il.datasets import card  # LeRobot: seconds of imports; mistakes are told before
    from er_il.datasets.encoding import decode_dataset, encode_dataset
    from er_il.datasets.source_columns import columns_to_restore, other_actions, unseen_cameras

    read_history(dataset.root)  # raises if it is damaged
    restored = decode and columns_to_restore(dataset, layout) is not None
    moved, cameras = ((), {}) if decode else (other_actions(dataset), unseen_cameras(dataset))
    notes = _notes(dataset, keep, moved, tuple(cameras))
    done = 0

    def advance(frames: int) -> None:
        nonlocal done
        done += frames
        on_progress(done, dataset.frames)

    def finish(partial: Path) -> None:
        options: dict[str, Any] = {"to": kind, "rotation": rotation, "decoded": decode}
        options |= {"chunk": layout.chunk} if layout.chunk else {}
        options |= {"weights": weights.to_dict()["arms"]} if weights else {}
        options |= _columns(dataset) | ({SPECIFICATION: layout.spec()} if restored else {})
        # A folder is named without its place on this machine.
        name = dataset.root.resolve().name if Path(source).exists() else source
        card.sign(Dataset(partial), name, options, notes, repo_id)

    statuses: Counter[str] = Counter()
    if decode:
        decoded = decode_dataset(dataset, target, layout, finish=finish, advance=advance)
        statuses.update(status for episode in decoded for status in episode.status.ravel().tolist())
    else:
        encode_dataset(dataset, target, layout, keep=keep, fit=True, finish=finish, advance=advance)
    return Reencoded(Dataset(target).layout, statuses, notes)


def _columns(dataset: Dataset) -> dict[str, list[str]]:
    """Where the joint vectors and the measured joints are from, if not from their usual columns."""
    parts = dataset.parts if isinstance(dataset, Assembled) else {}
    keys = {ACTION: "from", STATE: "state_from"}
    return {keys[name]: [_named(source, dataset) for source in part.sources] for name, part in parts.items()}


def _named(source: ColumnSource, dataset: Dataset) -> str:
    """A column, after the name of its dataset if that is another one; not its place on this machine."""
    other = source.dataset.root != dataset.root
    return f"{source.dataset.root.resolve().name}:{source.text}" if other else source.text


def _notes(dataset: Dataset, keep: bool, moved: Sequence[str], cameras: Sequence[str]) -> tuple[str, ...]:
    """What is not as in the source, and what is lost."""
    notes = []
    columns = _columns(dataset)
    if said := columns.get("from"):
        notes.append(f"The joint vectors are from {'; '.join(said)}.")
    if isinstance(dataset, Assembled) and dataset.measured:
        notes.append(
            f"What {', '.join(dataset.measured)} measured in the next frame stands for the command; the last frame of "
            "an episode commands where the arm is. How far the arm stayed behind its commands, and how hard it pushed "
            "against what held it, is lost."
        )
    if said := columns.get("state_from"):
        notes.append(f"{STATE} is from {'; '.join(said)}.")
    if moved:
        what = f"Renamed to {SOURCE}*" if keep else "Left out"
        notes.append(f"{what}, since LeRobot takes every column named {ACTION}* for actions: {', '.join(moved)}.")
    if cameras:
        notes.append(f"Renamed to {IMAGES}*, since LeRobot's policies get no other cameras: {', '.join(cameras)}.")
    return tuple(notes)
