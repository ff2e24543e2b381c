"""Convert the words behind a flag to the value of a setting's type, or say what is wrong with them."""

from collections.abc import Callable
from types import NoneType, UnionType
from typing import Any, Final, Literal, Union, get_args, get_origin

import tyro

from springfoot.errors import quoted


class _NotGiven:
    """Type of `NOT_GIVEN`."""

    def __repr__(self) -> str:
        return "NOT_GIVEN"


NOT_GIVEN: Final = _NotGiven()
"""Default of an optional flag."""
_NONE = "None"
_PLAIN: dict[Any, tuple[Callable[[str], Any], str]] = {
    int: (int, "a whole number"),
    float: (float, "a number"),
    str: (str, "a word"),
}


def flag_of(kind: Any) -> tyro.constructors.PrimitiveConstructorSpec:
    """Return tyro's reader of a flag whose value is of type `kind`, such as `tuple[float, float] | None`.

    The word `None` is a value only of types that can be None.
    """
    tuple_kind = next((part for part in _parts(kind) if get_origin(part) is tuple), kind)
    items = get_args(tuple_kind) if get_origin(tuple_kind) is tuple else ()
    count: Any = "*" if items[1:] == (...,) else len(items) or 1
    if tuple_kind is not kind and count != 1:
        count = (1, count)  # one word for None
    return spec(lambda words: _read(kind, words), metavar_of(kind), count)


def spec(read: Callable[[list[str]], Any], metavar: str, count: Any = 1) -> tyro.constructors.PrimitiveConstructorSpec:
    """Return tyro's reader of a flag of `count` words (a number, a range or "*"), which `read` converts to a value."""
    return tyro.constructors.PrimitiveConstructorSpec(
        nargs=count,
        metavar=metavar,
        instance_from_str=read,
        is_instance=lambda value: True,
        str_from_instance=lambda value: [str(value)],
    )


def metavar_of(kind: Any) -> str:
    """Return the help's placeholder for a value of this type."""
    parts = get_args(kind)
    if get_origin(kind) is Literal:
        return "|".join(map(str, parts))
    if get_origin(kind) is tuple:
        return f"{metavar_of(parts[0])} ..." if parts[1:] == (...,) else " ".join(map(metavar_of, parts))
    parts = [part for part in parts if part is not NoneType]
    return "|".join(map(metavar_of, parts)) if parts else kind.__name__.upper()


def _parts(kind: Any) -> tuple[Any, ...]:
    """Return the types of a union; a type that is no union alone."""
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _read(kind: Any, words: list[str]) -> Any:
    """Return the value of type `kind` that the words mean; raise `ValueError` with the allowed values for other
    words."""
    parts = _parts(kind)
    if NoneType in parts and words == [_NONE]:
        return None
    for part in parts:
        try:
            return _read_part(part, words)
        except ValueError:
            continue
    raise ValueError(f"must be {' or '.join(filter(None, map(_meaning, parts)))}, got {quoted(' '.join(words))}")


def _read_part(kind: Any, words: list[str]) -> Any:
    """Return the value of a type that is not a union; raise `ValueError` for other words."""
    if get_origin(kind) is tuple:
        items = get_args(kind)
        kinds = [items[0]] * len(words) if items[1:] == (...,) else items
        return tuple(_read_part(item_kind, [word]) for item_kind, word in zip(kinds, words, strict=True))
    (word,) = words
    if get_origin(kind) is Literal:
        return get_args(kind)[[str(value) for value in get_args(kind)].index(word)]
    if kind not in _PLAIN:
        raise ValueError
    return _PLAIN[kind][0](word)


def _meaning(kind: Any) -> str:
    """Return the allowed values of a type for an error message, such as "2 numbers"; empty for types without any."""
    if get_origin(kind) is Literal:
        return f"one of {', '.join(map(str, get_args(kind)))}"
    if get_origin(kind) is tuple:
        items = get_args(kind)
        count = "" if items[1:] == (...,) else f"{len(items)} "
        return f"{count}{_PLAIN[items[0]][1].removeprefix('a ')}s"
    return _PLAIN[kind][1] if kind in _PLAIN else ""
