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
from er_il.datasets.weights import WeightsFile
from er_il.datasets.wiring import Wiring, layout_of
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout
from er_il.support.atomic_files import check_absent, check_outside, check_writable


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
    repo_id: str = "",
    on_progress: Callable[[int, int], object],
) -> Reencoded:
    """Write a dataset again with its actions in another action space.

    Where the source is encoded, joint space is reached through the decoder, and other spaces from
    the joint vectors that it kept, or through the decoder if it kept none.

    Args:
        source: Folder, or repository id.
        target: Folder that does not exist.
        kind: See :func:`er_il.spaces.make_action_space`.
        rotation: ``quat`` or ``rot6d``.
        wirings: The arms of a dataset that does not know them.
        weights: Of ERX; those of the arms if omitted.
        keep: Keep the joint vectors beside the encoded actions.
        repo_id: Where the target will be on the hub, for its card.
        on_progress: Called with the number of frames done, and their total.

    Raises:
        ErIlError: the dataset, the arms or the space do not fit.
        FileExistsError: the target exists.
    """
    dataset = Dataset(find_dataset(source))
    known = layout_of(dataset, wirings)
    layout = known.in_space(kind, rotation, weights.of(known.arms) if weights else {})
    encoded = dataset.specified and dataset.spec["space"] != JOINT
    decode = encoded and (kind == JOINT or dataset.joints_column(layout) is None)
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
        options |= {"weights": weights.to_dict()["arms"]} if weights else {}
        # A folder is named without its place on this machine.
        name = dataset.root.resolve().name if Path(source).exists() else source
        card.sign(Dataset(partial), name, options, repo_id)

    statuses: Counter[str] = Counter()
    if decode:
        decoded = decode_dataset(dataset, target, layout, finish=finish, advance=advance)
        statuses.update(status for episode in decoded for status in episode.status.ravel().tolist())
    else:
        encode_dataset(dataset, target, layout, keep=keep, fit=True, finish=finish, advance=advance)
    return Reencoded(Dataset(target).layout, statuses)
