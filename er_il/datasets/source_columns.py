"""What an encoded dataset keeps of its source's actions and state, and how decoding puts it back."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from er_il.datasets.assembled import Assembled
from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.rewriting import Column, Copy
from er_il.datasets.schema import IMAGES, SOURCE, SOURCE_ACTION, SOURCE_JOINTS, STATE, Feature, dimension_names
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION

# In the info of an encoded action: the feature of the joint vectors that were its source's; of a camera: its old name.
RECORDED = "er_il_source"
OBSERVATION = "observation."  # how the names of columns start that LeRobot passes on to policies


@dataclass(frozen=True, eq=False)
class SourceColumns:
    """Columns of a dataset to be written, beside its actions."""

    columns: Mapping[str, Column] = field(default_factory=dict)
    copies: Mapping[str, Copy] = field(default_factory=dict)
    dropped: tuple[str, ...] = ()


def columns_to_keep(source: Dataset, layout: Layout, joints: str, vectors: Floats, keep: bool) -> SourceColumns:
    """What becomes of the source's columns when its joint vectors are encoded.

    Columns whose names start as LeRobot's ``action`` does are policy outputs to LeRobot: they go under
    :data:`~er_il.datasets.schema.SOURCE`, where no policy looks, as do actions and states that others replace. Cameras
    that policies would not get are renamed (:func:`unseen_cameras`).

    Args:
        source: The dataset.
        layout: Encodes its joint vectors.
        joints: The column that holds them.
        vectors: Their values (N, D).
        keep: Keep the joint vectors, and what is replaced.
    """
    put_together = source.parts if isinstance(source, Assembled) else {}
    recorded = source.recorded.features if isinstance(source, Assembled) else source.features
    others = other_actions(source)
    replaced = [name for name in put_together if name in recorded]
    if joints == ACTION and ACTION not in put_together and layout.kind != JOINT:
        replaced.append(ACTION)
    columns = {}
    if STATE in put_together:
        columns[STATE] = Column(source.features[STATE], source.vectors(STATE))
    if ACTION in put_together and keep:
        columns[SOURCE_JOINTS] = Column(source.features[ACTION], vectors)
    copies = {SOURCE + name: Copy(recorded[name], name) for name in (*replaced, *others) if keep}
    if SOURCE_ACTION in copies:  # what the actions meant is another spec's
        copies[SOURCE_ACTION] = Copy(recorded[ACTION] | {"info": None}, ACTION)
    cameras = unseen_cameras(source)
    copies |= {new: Copy(_renamed(recorded[name], name), name) for name, new in cameras.items()}
    return SourceColumns(columns, copies, (*others, *cameras))


def other_actions(dataset: Dataset) -> tuple[str, ...]:
    """Columns beside ``action`` that LeRobot would take for actions."""
    images = ("image", "video")
    return tuple(
        name
        for name, feature in dataset.features.items()
        if name.startswith(ACTION) and name != ACTION and feature["dtype"] not in images
    )


def unseen_cameras(dataset: Dataset) -> dict[str, str]:
    """Columns of pictures that LeRobot's policies would not get, with names under which they do.

    LeRobot takes every camera for a policy's input, but then passes on only columns that are named as observations.
    Videos, whose names are those of folders, keep them.
    """
    cameras = [name for name, feature in dataset.features.items() if feature["dtype"] == "image"]
    return {name: IMAGES + name for name in cameras if not name.startswith(OBSERVATION)}


def _renamed(feature: Feature, name: str) -> Feature:
    return feature | {"info": (feature.get("info") or {}) | {RECORDED: name}}


def _named_again(feature: Feature) -> Feature:
    info = {key: value for key, value in feature["info"].items() if key != RECORDED}
    return {key: value for key, value in feature.items() if key != "info"} | ({"info": info} if info else {})


def recorded_action(source: Dataset) -> Feature | None:
    """The feature to remember of the actions that are encoded, if they are joint vectors that nobody has described."""
    assembled = isinstance(source, Assembled) and ACTION in source.parts
    return None if source.specified or assembled else source.features[ACTION]


def columns_to_restore(encoded: Dataset, layout: Layout) -> tuple[Feature, SourceColumns] | None:
    """What decoding to joints puts back, so that LeRobot merges the result with the dataset that was encoded.

    Returns:
        The actions' feature as it was, and the columns; None if the actions were no joint vectors, or the dataset was
        encoded before er_il remembered.
    """
    feature = (encoded.features[ACTION].get("info") or {}).get(RECORDED)
    if not isinstance(feature, dict) or layout.kind != JOINT or dimension_names(feature) != layout.names:
        return None
    kept = [name for name in encoded.features if name.startswith(SOURCE + ACTION) or name == SOURCE + STATE]
    copies = {name.removeprefix(SOURCE): Copy(encoded.features[name], name) for name in kept if name != SOURCE_ACTION}
    for name, each in encoded.features.items():
        if isinstance(camera := (each.get("info") or {}).get(RECORDED), str):
            copies[camera] = Copy(_named_again(each), name)
            kept.append(name)
    return feature | {"shape": tuple(feature["shape"])}, SourceColumns(copies=copies, dropped=tuple(kept))
