"""Re-encoding as a user asks for it: any LeRobot dataset by name, with or without a specification."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from er_il.datasets.dataset import Dataset
from er_il.datasets.hub import find_dataset
from er_il.datasets.integrity import check_whole
from er_il.datasets.number_checks import check_numbers
from er_il.datasets.schema import STATE
from er_il.datasets.weights import WeightsFile
from er_il.datasets.wiring import Wiring, wire
from er_il.spaces.chunk import CHUNK, commands_of
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout
from er_il.spaces.relative import RelativeActions
from er_il.support.atomic_files import check_absent, check_outside, check_writable
from er_il.support.errors import DatasetError


@dataclass(frozen=True)
class Reencoded:
    """A dataset that was written."""

    layout: Layout  # of its actions
    statuses: Counter[str]  # decoded commands by er_il.Status; empty if nothing had to be decoded


def reencode(
    source: str,
    target: Path,
    kind: str,
    *,
    rotation: str,
    wirings: Sequence[Wiring],
    weights: WeightsFile | None = None,
    keep: bool,
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
        keep: Keep the joint vectors beside the encoded actions.
        chunk: Number of actions of a chunk, in a chunk-relative space.
        on_progress: Called with the number of frames done, and their total.

    Raises:
        ErIlError: the dataset, the arms or the space do not fit.
        FileExistsError: the target exists.
    """
    dataset = Dataset(find_dataset(source))
    if dataset.specified and wirings:
        raise DatasetError(f"{source} says which arms it is of: leave out --arm and --arms.")
    if not dataset.specified and not wirings:
        raise DatasetError(f"{source} does not say which arm it is of: give --arm, and --joints for its joints.")
    known = dataset.layout if dataset.specified else wire(wirings, dataset.features, JOINT, rotation)
    layout = known.in_space(kind, rotation, weights.of(known.arms) if weights else {}, chunk)
    if layout.chunk:
        RelativeActions(layout, dataset.names(STATE))  # raises unless the state measures what they count from
    encoded = dataset.specified and commands_of(dataset.spec["space"]) != JOINT
    decode = encoded and (commands_of(kind) == JOINT or dataset.joints_column(layout) is None)
    check_absent(target)
    check_outside(target, dataset.root)
    check_writable(target)
    check_whole(dataset)
    check_numbers(dataset, layout if not encoded else dataset.layout)
    from er_il.datasets import card  # LeRobot: seconds of imports; mistakes are told before
    from er_il.datasets.encoding import decode_dataset, encode_dataset

    card.read_history(dataset.root)  # raises if it is damaged
    done = 0

    def advance(frames: int) -> None:
        nonlocal done
        done += frames
        on_progress(done, dataset.frames)

    def finish(partial: Path) -> None:
        options: dict[str, Any] = {"to": kind, "rotation": rotation, "decoded": decode}
        options |= {"chunk": layout.chunk} if layout.chunk else {}
        options |= {"weights": weights.to_dict()["arms"]} if weights else {}
        # A folder is named without its place on this machine.
        card.sign(Dataset(partial), dataset.root.resolve().name if Path(source).exists() else source, options)

    statuses: Counter[str] = Counter()
    if decode:
        decoded = decode_dataset(dataset, target, layout, finish=finish, advance=advance)
        statuses.update(status for episode in decoded for status in episode.status.ravel().tolist())
    else:
        encode_dataset(dataset, target, layout, keep=keep, fit=True, finish=finish, advance=advance)
    return Reencoded(Dataset(target).layout, statuses)
