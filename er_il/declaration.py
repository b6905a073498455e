"""Plain values from a YAML file, checked against the dataclass that they declare."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml

from er_il.errors import ErIlError


def read_declaration[T](path: Path, what: str, error: type[ErIlError], build: Callable[[object], T]) -> T:
    """Read what a YAML (or JSON) file declares.

    Args:
        path: The file.
        what: What it should be, such as "recipe".
        error: What to raise if it is missing, unreadable, or refused by ``build``.
        build: Makes the declared object of plain values.
    """
    try:
        values = yaml.safe_load(path.read_text())
    except FileNotFoundError as cause:
        raise error(f"There is no {what} {path}.") from cause
    except (yaml.YAMLError, UnicodeDecodeError) as cause:
        raise error(f"{path} is not valid YAML.") from cause
    try:
        return build(values)
    except ErIlError as cause:
        raise error(f"{path}: {cause}") from cause


def keys_of(declared: type[Any], values: object, what: str, error: type[ErIlError]) -> Mapping[str, Any]:
    """Return values as a mapping that has the keys of a dataclass, none unknown and none missing.

    Args:
        declared: The dataclass; fields without a default are required.
        values: What a file said.
        what: What it should be, such as "recipe".
        error: What to raise if it is something else.
    """
    if not isinstance(values, Mapping):
        raise error(f"A {what} is a mapping of keys to values.")
    fields = {each.name: each for each in dataclasses.fields(declared)}
    if unknown := [str(key) for key in values if key not in fields]:
        raise error(f"A {what} has no {', '.join(unknown)}. Valid: {', '.join(fields)}.")
    required = [name for name, each in fields.items() if _required(each)]
    if missing := [name for name in required if name not in values]:
        raise error(f"The {what} lacks {', '.join(missing)}.")
    return values


def _required(each: "dataclasses.Field[Any]") -> bool:
    return each.default is dataclasses.MISSING and each.default_factory is dataclasses.MISSING
