"""Where a policy comes from: its files, and what describes the dataset that it was trained on."""

from pathlib import Path
from typing import Any

from er_il.support.errors import DatasetError, PolicyError
from er_il.support.json_files import read_json

INFO = "meta/info.json"  # of a LeRobot dataset
CONFIG = "config.json"  # of a policy
TRAINING = "train_config.json"  # which LeRobot keeps beside a policy's weights


def policy_file(policy: str | Path, name: str) -> Path | None:
    """A file of a policy, in its folder or from the Hub; None if the policy has none of that name.

    Raises:
        PolicyError: the Hub has no such policy, or cannot be reached.
    """
    if Path(policy).is_dir():
        file = Path(policy) / name
        return file if file.exists() else None
    from huggingface_hub import hf_hub_download
    from huggingface_hub.errors import EntryNotFoundError

    try:
        return Path(hf_hub_download(str(policy), name))  # the file that LeRobot will find in the cache
    except EntryNotFoundError:
        return None
    except (OSError, ValueError) as error:  # huggingface_hub's errors derive from these
        raise PolicyError(f"No policy at {policy}: {str(error).splitlines()[0]}") from error


def at_hand(policy: str | Path) -> bool:
    """True if a policy can be read on this machine; that of a policy server elsewhere may not be."""
    try:
        return policy_file(policy, CONFIG) is not None
    except PolicyError:
        return False


def dataset_info(root: str | Path) -> dict[str, Any]:
    """Read the ``meta/info.json`` of a LeRobot dataset.

    Raises:
        DatasetError: there is no dataset at ``root``.
    """
    return read_json(Path(root) / INFO, DatasetError)


def training_info(policy: str | Path) -> dict[str, Any] | None:
    """The ``meta/info.json`` of the dataset that a policy was trained on; None where it is not at hand.

    It is looked for in the folder that the training read. A training that named none read a dataset by its
    repository id: that is looked for in LeRobot's cache, and on the Hub.

    Raises:
        PolicyError: see :func:`policy_file`; or the training's configuration is damaged.
    """
    path = policy_file(policy, TRAINING)
    if path is None:
        return None
    dataset = read_json(path, PolicyError).get("dataset")
    if not isinstance(dataset, dict):
        return None
    root, repository, revision = (dataset.get(key) for key in ("root", "repo_id", "revision"))
    try:
        if isinstance(root, str):
            return dataset_info(root)
        return _info_by_id(repository, revision) if isinstance(repository, str) else None
    except (OSError, ValueError, DatasetError):  # huggingface_hub's errors derive from the first two
        return None  # the dataset has moved, or the Hub does not give it


def _info_by_id(repository: str, revision: Any) -> dict[str, Any]:
    from huggingface_hub import hf_hub_download
    from lerobot.utils.constants import HF_LEROBOT_HOME, HF_LEROBOT_HUB_CACHE

    if (HF_LEROBOT_HOME / repository / INFO).is_file():
        return dataset_info(HF_LEROBOT_HOME / repository)
    options: dict[str, Any] = {"repo_type": "dataset", "revision": revision, "cache_dir": HF_LEROBOT_HUB_CACHE}
    return read_json(Path(hf_hub_download(repository, INFO, **options)), DatasetError)
