"""Plain values from a YAML file, checked against the class that declares them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from er_il.support.errors import ErIlError


class Declaration(BaseModel):
    """Values that a person writes into a YAML file: immutable, no key but the declared ones, no silent conversion."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    noun: ClassVar[str]  # for people, such as "recipe"
    error: ClassVar[type[ErIlError]]  # of values that are no such declaration

    @classmethod
    def from_file(cls, path: Path) -> Self:
        """Read the declaration from a YAML (or JSON) file.

        Raises:
            ErIlError: of the class's kind: the file is unreadable, or declares something else.
        """
        return read_declaration(path, cls.noun, cls.error, cls.from_dict)

    @classmethod
    def from_dict(cls, values: object, noun: str = "") -> Self:
        """Build the declaration from plain values, such as :meth:`to_dict` gives.

        Args:
            values: What a file said.
            noun: A more precise one than the class's, for messages.

        Raises:
            ErIlError: of the class's kind: keys are missing, unknown, or of the wrong type; names all that is wrong.
        """
        noun = noun or cls.noun
        if not isinstance(values, Mapping):
            raise cls.error(f"A {noun} is a mapping of keys to values.")
        try:
            return cls.model_validate(dict(values))
        except ValidationError as cause:
            raise cls.error(_message(cause, noun, cls.model_fields)) from cause

    def replaced(self, **changes: Any) -> Self:
        """Return the declaration with other values for some keys.

        Raises:
            ErIlError: of the class's kind: a key is unknown, or a value is none that it can have.
        """
        return self.from_dict(dict(self) | changes)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or YAML."""
        return self.model_dump(mode="json")


def read_declaration[T](path: Path, noun: str, error: type[ErIlError], build: Callable[[object], T]) -> T:
    """Read what a YAML (or JSON) file declares.

    Args:
        path: The file.
        noun: What it should be, such as "recipe".
        error: What to raise if it is missing, unreadable, or refused by ``build``.
        build: Makes the declared object of plain values.
    """
    try:
        values = yaml.safe_load(path.read_text())
    except FileNotFoundError as cause:
        raise error(f"There is no {noun} {path}.") from cause
    except (yaml.YAMLError, UnicodeDecodeError) as cause:
        raise error(f"{path} is not valid YAML.") from cause
    try:
        return build(values)
    except ErIlError as cause:
        raise error(f"{path}: {cause}") from cause


def _message(cause: ValidationError, noun: str, valid: Mapping[str, Any]) -> str:
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
        said.insert(0, f"The {noun} lacks {', '.join(found['missing'])}.")
    if found["extra_forbidden"]:
        said.insert(0, f"A {noun} has no {', '.join(found['extra_forbidden'])}. Valid: {', '.join(valid)}.")
    return " ".join(said)
