"""Plain values from a YAML file, checked against the dataclass that they declare."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from er_il.support.errors import ErIlError


class Declaration(BaseModel):
    """Values that a person writes into a YAML file: immutable, no key but the declared ones, no silent conversion."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def declared[T: Declaration](kind: type[T], values: object, what: str, error: type[ErIlError]) -> T:
    """Build a declaration from plain values.

    Args:
        kind: The declaration.
        values: What a file said.
        what: What it should be, such as "recipe".
        error: What to raise if the values are something else; the message names all that is wrong.
    """
    if not isinstance(values, Mapping):
        raise error(f"A {what} is a mapping of keys to values.")
    try:
        return kind.model_validate(dict(values))
    except ValidationError as cause:
        raise error(_message(cause, kind, what)) from cause


def _message(cause: ValidationError, kind: type[Declaration], what: str) -> str:
    """All that is wrong, in one line."""
    found: dict[str, list[str]] = {"extra_forbidden": [], "missing": []}
    said = []
    for each in cause.errors(include_url=False):
        where = ".".join(map(str, each["loc"]))
        if each["type"] in found:
            found[each["type"]].append(where)
            continue
        text = each["msg"].removeprefix("Value error, ")
        said.append(f"{where} is {each['input']!r}: {text}." if where else f"{text}.")
    if found["missing"]:
        said.insert(0, f"The {what} lacks {', '.join(found['missing'])}.")
    if found["extra_forbidden"]:
        said.insert(0, f"A {what} has no {', '.join(found['extra_forbidden'])}. Valid: {', '.join(kind.model_fields)}.")
    return " ".join(said)


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
