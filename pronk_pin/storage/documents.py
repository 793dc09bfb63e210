"""JSON, TOML and YAML documents: read, compared with a type, and sealed against changes."""

from __future__ import annotations

import functools
import hashlib
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import msgspec.inspect
import yaml

from ..errors import InvalidInput
from .reading import damaged, read_text, reading

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_T = TypeVar("_T")


def read_json(path: Path | str, remedy: str) -> Any:
    """Read a JSON document.

    Raises:
        FileProblem: It cannot be read, or is no JSON.
    """
    text = read_text(path, remedy)
    with reading(path, remedy):
        return json.loads(text)


def read_toml(path: Path | str, remedy: str) -> dict[str, Any]:
    """Read a TOML document.

    Raises:
        FileProblem: It cannot be read, or is no TOML.
    """
    text = read_text(path, remedy)
    with reading(path, remedy):
        return tomllib.loads(text)


def read_yaml(path: Path | str, remedy: str) -> Any:
    """Read a YAML document; JSON is one.

    Raises:
        FileProblem: It cannot be read, or is no YAML.
    """
    text = read_text(path, remedy)
    with reading(path, remedy):
        return yaml.safe_load(text)


def as_type(
    document: object, kind: type[_T], path: Path | str, remedy: str, *, what: str = ""
) -> _T:
    """What a JSON document says, as a dataclass or another type.

    Args:
        document: Lists, dictionaries, strings, numbers, as `read_json` gives them.
        kind: The type; unknown fields of a dataclass are refused.
        path: Where the document comes from, for the error.
        remedy: What to do where it is something else.
        what: What the file should be.

    Raises:
        FileProblem: It is something else.
        PronkError: What the dataclass itself raises for values that are out of range.
    """
    try:
        _check_fields(document, kind, complete=False)
        return msgspec.convert(document, kind)
    except (msgspec.ValidationError, RecursionError) as error:
        raise damaged(path, error, remedy, what=what) from error


def from_text(text: str, kind: type[_T], what: str, remedy: str) -> _T:
    """What JSON says that one of our own dataclasses was written to with everything in it.

    Args:
        text: The text.
        kind: The dataclass; a field too few is refused as one too many.
        what: What the text should be, as in "a scenario".
        remedy: How to come by it, as in "make the strides again".

    Raises:
        InvalidInput: The text is something else.
        PronkError: What the dataclass itself raises for values that are out of range.
    """
    try:
        document = json.loads(text)
        _check_fields(document, kind, complete=True)
        return msgspec.convert(document, kind)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"this is not {what} ({error}); {remedy}") from error


def _check_fields(document: object, kind: Any, *, complete: bool) -> None:
    """Refuse fields that a dataclass, or one within it, does not have; or, if complete, lacks."""
    _compare_fields(document, _type_info(kind), complete)


@functools.lru_cache(maxsize=64)
def _type_info(kind: Any) -> msgspec.inspect.Type:
    return msgspec.inspect.type_info(kind)


def _compare_fields(document: object, info: msgspec.inspect.Type, complete: bool) -> None:
    inspect = msgspec.inspect
    if isinstance(info, inspect.UnionType):
        structured = [part for part in info.types if not isinstance(part, inspect.NoneType)]
        if len(structured) == 1:
            _compare_fields(document, structured[0], complete)
    elif isinstance(info, inspect.DataclassType) and isinstance(document, dict):
        fields = {field.name: field.type for field in info.fields}
        for strangers, word in [
            (document.keys() - fields.keys(), "unknown"),
            (fields.keys() - document.keys() if complete else set(), "missing"),
        ]:
            if strangers:
                listed = ", ".join(sorted(map(str, strangers)))
                raise msgspec.ValidationError(f"{word} field {listed}")
        for name, part in document.items():
            _compare_fields(part, fields[name], complete)
    elif isinstance(info, inspect.ListType | inspect.VarTupleType) and isinstance(document, list):
        for part in document:
            _compare_fields(part, info.item_type, complete)
    elif isinstance(info, inspect.DictType) and isinstance(document, dict):
        for part in document.values():
            _compare_fields(part, info.value_type, complete)


def sha256(data: bytes | str) -> str:
    """SHA-256 of bytes, or of text as UTF-8, in hexadecimal digits."""
    return hashlib.sha256(data.encode() if isinstance(data, str) else data).hexdigest()


def sealed(document: Mapping[str, Any]) -> str:
    """A JSON document as text, with the SHA-256 of what it says in its last field, `sha256`."""
    body = {key: value for key, value in document.items() if key != "sha256"}
    return json.dumps({**body, "sha256": sha256(_canonical(body))}, indent=2) + "\n"


def read_sealed(path: Path | str, remedy: str) -> dict[str, Any]:
    """Read a JSON document that `sealed` made, without its seal.

    Raises:
        FileProblem: It cannot be read, or says something else than when it was sealed.
    """
    document = read_json(path, remedy)
    if not isinstance(document, dict) or "sha256" not in document:
        raise damaged(path, "it has no 'sha256'", remedy)
    seal = document.pop("sha256")
    if seal != sha256(_canonical(document)):
        raise damaged(path, "it was changed after it was written", remedy)
    return document


def _canonical(document: object) -> str:
    return json.dumps(document, sort_keys=True, separators=(",", ":"))
