"""Convert the words behind a flag to the value of a setting's type, or name their fault."""

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
"""Plain type -> its conversion from a word, and its allowed values in words."""


def flag_of(kind: Any) -> tyro.constructors.PrimitiveConstructorSpec:
    """Return tyro's reader of a flag of type `kind`, such as `tuple[float, float] | None`.

    The word `None` is a value only of types that can be None. A flag of type `bool` alone means True.
    """
    if kind is bool:
        return reader_of_words(lambda words: not words or _read(Literal[True, False], words), "[True|False]", (0, 1))
    return reader_of_words(lambda words: _read(kind, words), metavar_of(kind), _count_of_words(kind))


def _count_of_words(kind: Any) -> Any:
    """Return the number of words of a value of type `kind`, as `reader_of_words` takes it."""
    tuple_kind = next((part for part in _parts(kind) if get_origin(part) is tuple), None)  # `kind`, or a part of it
    items = get_args(tuple_kind) if tuple_kind is not None else ()
    if _is_open(items):
        return "*"
    if len(items) < 2:
        return 1
    may_be_none = tuple_kind != kind
    return (1, len(items)) if may_be_none else len(items)  # None is one word


def reader_of_words(
    read: Callable[[list[str]], Any], metavar: str, count: Any = 1
) -> tyro.constructors.PrimitiveConstructorSpec:
    """Return tyro's reader of a flag, by which `read` converts the words behind the flag to its value.

    Args:
        read: function that returns the value of the words; raises `ValueError`, with the allowed values, for others.
        metavar: the help's placeholder for the words.
        count: number of words: a number, a tuple of the allowed numbers, or "*" for any.
    """
    return tyro.constructors.PrimitiveConstructorSpec(
        nargs=count,
        metavar=metavar,
        instance_from_str=read,
        is_instance=lambda value: True,  # `read` checks the value
        str_from_instance=lambda value: [str(value)],  # in the help alone
    )


def _is_open(items: tuple[Any, ...]) -> bool:
    """Return True for the items of `tuple[kind, ...]`, a tuple of any length."""
    return items[1:] == (...,)


def metavar_of(kind: Any) -> str:
    """Return the help's placeholder for a value of type `kind`, such as "FLOAT FLOAT" for a pair."""
    parts = get_args(kind)
    if get_origin(kind) is Literal:
        return "|".join(map(str, parts))
    if get_origin(kind) is tuple:
        return f"{metavar_of(parts[0])} ..." if _is_open(parts) else " ".join(map(metavar_of, parts))
    parts = [part for part in parts if part is not NoneType]
    return "|".join(map(metavar_of, parts)) if parts else kind.__name__.upper()


def _parts(kind: Any) -> tuple[Any, ...]:
    """Return the types of a union; for another type that type alone."""
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _read(kind: Any, words: list[str]) -> Any:
    """Return the value of type `kind` that the words mean; raise `ValueError` with the allowed values for other
    words."""
    parts = _parts(kind)
    if NoneType in parts and words == [_NONE]:
        return None
    for part in parts:  # the first type that takes the words
        try:
            return _read_part(part, words)
        except ValueError:
            continue
    raise ValueError(f"must be {' or '.join(filter(None, map(_allowed_values, parts)))}, got {quoted(' '.join(words))}")


def _read_part(kind: Any, words: list[str]) -> Any:
    """Return the value of the type `kind`, no union, that `words` mean; raise `ValueError` if they mean none."""
    if get_origin(kind) is tuple:
        items = get_args(kind)
        kinds = [items[0]] * len(words) if _is_open(items) else items
        return tuple(_read_part(item_kind, [word]) for item_kind, word in zip(kinds, words, strict=True))
    (word,) = words
    if get_origin(kind) is Literal:
        allowed = {str(value): value for value in get_args(kind)}
        if word not in allowed:
            raise ValueError
        return allowed[word]
    if kind not in _PLAIN:
        raise ValueError
    convert, _ = _PLAIN[kind]
    return convert(word)


def _allowed_values(kind: Any) -> str:
    """Return the allowed values of a type for an error message, such as "2 numbers"; empty for types without any."""
    if get_origin(kind) is Literal:
        return f"one of {', '.join(map(str, get_args(kind)))}"
    if get_origin(kind) is tuple:
        items = get_args(kind)
        count = "" if _is_open(items) else f"{len(items)} "
        _, words = _PLAIN[items[0]]
        return f"{count}{words.removeprefix('a ')}s"
    return _PLAIN[kind][1] if kind in _PLAIN else ""
