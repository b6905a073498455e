"""Datasets by name: folders, or LeRobot's repository ids, which LeRobot itself looks up and downloads."""

from collections.abc import Sequence
from pathlib import Path

from er_il.datasets.dataset import INFO, conversion, datasets_in
from er_il.support.errors import DatasetError


def find_dataset(source: str) -> Path:
    """Folder of a dataset.

    Args:
        source: A folder, or a repository id such as ``lerobot/pusht``.

    Raises:
        DatasetError: there is no such dataset, or it cannot be downloaded.
    """
    folder = Path(source)
    if folder.exists() or folder.is_absolute() or source.count("/") != 1:
        return folder  # whoever reads it says what is wrong with it
    import httpx
    from lerobot.datasets import LeRobotDataset  # seconds of imports that a folder does without
    from lerobot.datasets.utils import BackwardCompatibilityError

    try:
        return Path(LeRobotDataset(source, video_backend="pyav").root)
    except BackwardCompatibilityError as error:
        how = conversion("v2.1", Path(Path(source).name), source)
        raise DatasetError(f"{source} is a LeRobot dataset of version v2.1, not v3.0. {how}") from error
    # huggingface_hub's own errors are OSErrors and ValueErrors; without a network, its client's come through.
    except (OSError, ValueError, NotImplementedError, httpx.HTTPError) as error:
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise DatasetError(f"{source} is neither a folder nor a dataset that LeRobot can load: {reason}") from error


def find_datasets(names: Sequence[str]) -> list[Path]:
    """Resolve what a user names: a dataset, a folder of datasets, or a task (its folder in ``datasets``).

    Raises:
        DatasetError: nothing is there.
    """
    found = []
    for name in names:
        folder = next((path for path in (Path(name), Path("datasets") / name) if path.is_dir()), None)
        inside = [] if folder is None else datasets_in(folder)
        if folder is not None and (folder / INFO).is_file():
            found.append(folder)
        elif inside:
            found += inside
        else:
            raise DatasetError(f"No dataset at {name}. Generate one first: er-il generate TASK.")
    return found
