"""What LeRobot's training command lacks: resuming exactly, and stopping where the numbers stop being numbers."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from accelerate.data_loader import DataLoaderShard, get_sampler
from lerobot.common import train_utils
from lerobot.scripts import lerobot_train
from lerobot.utils.constants import LAST_CHECKPOINT_LINK
from lerobot.utils.random_utils import get_rng_state, set_rng_state
from lerobot.utils.utils import cycle

from er_il.support.atomic_files import write_atomically
from er_il.support.errors import PolicyError


def cycle_where_it_was(loader: DataLoaderShard) -> Iterator[Any]:
    """Go through the data for ever, in place of LeRobot's ``cycle``: after a resume, with the batches and the random
    numbers that would have come without an interruption.

    LeRobot puts its sampler where it was, but Accelerate's loader then begins at epoch 0 again. And a loader draws a
    random number when it begins an epoch, which a run that is resumed in the middle of one has drawn already.
    """
    position = get_sampler(loader).state_dict()  # pyrefly: ignore[missing-attribute]  LeRobot's own
    loader.set_epoch(position["epoch"])
    drawn = position["start_index"] > 0 or (position["epoch"] > 0 and loader.persistent_workers)
    batches, state = cycle(loader), get_rng_state()
    first = next(batches)
    if drawn:
        set_rng_state(state)
    yield first
    yield from batches


def stop_at_nan(update: Callable[..., tuple[Any, Any]]) -> Callable[..., tuple[Any, Any]]:
    """Let LeRobot's ``update_policy`` raise a PolicyError when the loss, or a step of the optimizer, is not finite."""

    def checked(tracker: Any, *args: Any, **kwargs: Any) -> tuple[Any, Any]:
        try:
            tracker, outputs = update(tracker, *args, **kwargs)
        except RuntimeError as error:
            if "overflow" not in str(error):
                raise
            raise _diverged(f"a step of the optimizer is too large ({error})", tracker.steps + 1) from error
        if not math.isfinite(tracker.loss.val):
            raise _diverged(f"the loss is {tracker.loss.val}", tracker.steps + 1)
        return tracker, outputs

    return checked


def save_finite_checkpoint(*, step: int, policy: Any, **rest: Any) -> None:
    """Save a checkpoint as LeRobot does, in place of its ``save_checkpoint``.

    Raises:
        PolicyError: not all weights are finite; nothing is saved, and the last checkpoint stays the last one.
    """
    if not all(weights.isfinite().all() for weights in policy.parameters()):
        raise _diverged("weights are not finite", step)
    train_utils.save_checkpoint(step=step, policy=policy, **rest)


def move_last(checkpoint: Path) -> None:
    """Let the link to the last checkpoint point to this one, in place of LeRobot's ``update_last_checkpoint``.

    LeRobot's own removes the link before it makes it anew; a kill between loses the place of the last checkpoint.
    """
    last = checkpoint.with_name(LAST_CHECKPOINT_LINK)
    write_atomically(last, lambda partial: partial.symlink_to(checkpoint.name))


def install() -> None:
    """Put all of this into LeRobot's command, in this process."""
    lerobot_train.cycle = cycle_where_it_was  # pyrefly: ignore[bad-assignment]
    lerobot_train.update_policy = stop_at_nan(lerobot_train.update_policy)
    lerobot_train.save_checkpoint = save_finite_checkpoint  # pyrefly: ignore[bad-assignment]
    lerobot_train.update_last_checkpoint = move_last  # pyrefly: ignore[bad-assignment]


def _diverged(what: str, step: int) -> PolicyError:
    return PolicyError(
        f"The training diverged: {what} at step {step}. The last checkpoint is from before. Check the dataset "
        "(er-il verify), or train with a smaller learning rate."
    )
