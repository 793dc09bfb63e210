"""Options as the help shows them, where tyro would show how they are made."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, is_typeddict

from tyro.conf import arg
from tyro.constructors import (
    ConstructorRegistry,
    PrimitiveConstructorSpec,
    PrimitiveTypeInfo,
    StructConstructorSpec,
    StructFieldSpec,
    StructTypeInfo,
    UnsupportedTypeAnnotationError,
)

REGISTRY = ConstructorRegistry()
"""What tyro does otherwise here."""

_asked: list[object] = []
"""Classes whose fields tyro itself is being asked for."""


@REGISTRY.struct_rule
def _command(info: StructTypeInfo) -> StructConstructorSpec | None:
    """A class of options as tyro has it, each option as `_option` has it."""
    if info.type in _asked:
        return None
    _asked.append(info.type)
    try:
        spec = ConstructorRegistry.get_struct_spec(info)
    finally:
        _asked.pop()
    if not isinstance(spec, StructConstructorSpec):
        return None
    values = "(here: {})" if is_typeddict(info.type) else "(default: {})"
    return dataclasses.replace(spec, fields=tuple(_option(part, values) for part in spec.fields))


def _option(field: StructFieldSpec, values: str) -> StructFieldSpec:
    """An option whose text flows, and whose default is shown where it is a value; where it is none,
    its text says what happens. A dictionary's texts always do: what is in it was asked for."""
    kind: Any = field.type
    kind, *marks = get_args(kind) if get_origin(kind) is Annotated else (kind,)
    spec = _spec(kind)
    if spec is not None:
        kind = object  # for what is no plain class tyro imports typeguard, which takes long
        marks.append(spec)
    value = isinstance(field.default, bool | int | float | str | tuple | Path)
    hint = "" if not value or field.default in ("", ()) else values
    marks.insert(0, arg(help_behavior_hint=hint.format))
    shown: Any = Annotated[(kind, *marks)]
    return dataclasses.replace(field, type=shown, helptext=lambda: _text(field))


def _text(field: StructFieldSpec) -> str | None:
    text = field.helptext() if callable(field.helptext) else field.helptext
    return None if text is None else " ".join(text.split())


def _spec(kind: Any) -> PrimitiveConstructorSpec[Any] | None:
    """How tuples are read, and `X | None`: as an X, and the word None as none."""
    inner = [part for part in get_args(kind) if part is not type(None)]
    optional = get_origin(kind) in (Union, UnionType) and len(inner) == 1
    if not optional and get_origin(kind) is not tuple:
        return None
    asked = PrimitiveTypeInfo.make(inner[0] if optional else kind, set())
    spec = ConstructorRegistry.get_primitive_spec(asked)
    if isinstance(spec, UnsupportedTypeAnnotationError):
        return None
    if not optional:
        return spec
    return dataclasses.replace(
        spec,
        instance_from_str=lambda words: (
            None if words == ["None"] else spec.instance_from_str(words)
        ),
        str_from_instance=lambda value: (
            ["None"] if value is None else spec.str_from_instance(value)
        ),
        is_instance=lambda value: value is None or spec.is_instance(value),
    )
