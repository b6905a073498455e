"""Plain values from a YAML file, checked against the class that declares them."""

import reprlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from er_il.support.errors import ErIlError

MOST_VALUES = 100_000  # in a file that a person wrote
MOST_MISTAKES = 5  # that are listed


class Declaration(BaseModel):
    """Values that a person writes into a YAML file: immutable, no key but the declared ones, no silent conversion."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    noun: ClassVar[str]  # for people, such as "recipe"
    error: ClassVar[type[ErIlError]]  # of values that are no such declaration
    later: ClassVar[tuple[str, ...]] = ()  # keys that are left out at their default: what is written stays as it was

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
        fields = type(self).model_fields
        usual = {name for name in self.later if getattr(self, name) == fields[name].default}
        return self.model_dump(mode="json", exclude=usual)


def read_declaration[T](path: Path, noun: str, error: type[ErIlError], build: Callable[[object], T]) -> T:
    """Read what a YAML (or JSON) file declares.

    Args:
        path: The file.
        noun: What it should be, such as "recipe".
        error: What to raise if it is missing, unreadable, or refused by ``build``.
        build: Makes the declared object of plain values.
    """
    values = read_yaml(path, noun, error)
    try:
        return build(values)
    except ErIlError as cause:
        raise error(f"{path}: {cause}") from cause


def read_yaml(path: Path, noun: str, error: type[ErIlError]) -> object:
    """Read the plain values in a YAML (or JSON) file. Tags, which would make other objects, are refused.

    Args:
        path: The file.
        noun: What it should be, such as "recipe".
        error: What to raise if it is missing or unreadable.
    """
    try:
        values = yaml.safe_load(path.read_text())
    except FileNotFoundError as cause:
        raise error(f"There is no {noun} {path}.") from cause
    except (yaml.YAMLError, ValueError, RecursionError) as cause:  # ValueError: no UTF-8, no such date
        where = getattr(cause, "problem_mark", None)
        said = f" (line {where.line + 1}: {cause.problem})" if where and hasattr(cause, "problem") else ""
        raise error(f"{path} is not valid YAML{said}.") from cause
    if _more_values_than(values, MOST_VALUES):
        raise error(f"{path} holds more than {MOST_VALUES} values: that is no {noun}.")
    return values


def _more_values_than(values: object, most: int) -> bool:
    """True if plain values are many. Aliases let a few lines of YAML mean billions, or contain themselves."""
    waiting, count = [values], 0
    while waiting and count <= most:
        value = waiting.pop()
        count += 1
        waiting += [*value, *value.values()] if isinstance(value, dict) else value if isinstance(value, list) else []
    return count > most


def check_values(kind: type[BaseModel], values: object, what: object, error: type[ErIlError]) -> None:
    """Check what a file of others says against the class that describes what er_il needs of it.

    Args:
        kind: The class.
        values: What the file said.
        what: The file's path, or what else to call it.
        error: What to raise if it says something else; names the file and what is wrong.
    """
    try:
        kind.model_validate(values)
    except ValidationError as cause:
        raise error(f"{what} is damaged: {_message(cause, 'file', kind.model_fields)}") from cause


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
        said.append(f"{where} is {reprlib.repr(each['input'])}: {text}." if where else f"{text}.")
    keys = [str(getattr(field, "validation_alias", None) or name) for name, field in valid.items()]
    if found["missing"]:
        said.insert(0, f"The {noun} lacks {', '.join(found['missing'])}.")
    if found["extra_forbidden"]:
        said.insert(0, f"A {noun} has no {', '.join(found['extra_forbidden'])}. Valid: {', '.join(keys)}.")
    return " ".join(said[:MOST_MISTAKES])
