"""Command-line flags made from dataclasses of settings: their names, types and help stand once, in the dataclass."""

import ast
import dataclasses
import inspect
import json
import textwrap
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import tyro

from springfoot.envs.settings import BipedSettings
from springfoot.gait.own_data import read_gait


def _field_help(settings: type) -> dict[str, str]:
    """The docstring below each field of a dataclass, on one line."""
    body = ast.parse(textwrap.dedent(inspect.getsource(settings))).body[0].body  # type: ignore[attr-defined]
    return {
        item.target.id: " ".join(str(doc.value.value).split())
        for item, doc in pairwise(body)
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and isinstance(doc, ast.Expr)
        and isinstance(doc.value, ast.Constant)
    }


def _read_json(words: list[str]) -> dict[str, Any]:
    """A dictionary from JSON text, or from the JSON file of that name."""
    text = words[0]
    if not text.lstrip().startswith("{"):
        path = Path(text)
        if not path.is_file():
            raise ValueError(f"{text!r} is neither JSON text in braces nor the name of a JSON file")
        text = path.read_text(encoding="utf-8")
    value = json.loads(text)
    if not isinstance(value, dict):
        raise ValueError("the JSON must be an object in braces")
    return value


def read_own_gait(words: str) -> dict[str, Any]:
    """The setting `human` from what `--human` is given.

    A file of `read_gait`; FILE:CONDITION for one of several in a CSV; several files of one walk with commas between.
    Raises `SpringfootError` for a file that cannot be read.
    """
    if Path(words).is_file():
        return read_gait(words).to_json()
    if "," in words:
        return read_gait(*words.split(",")).to_json()
    file, _, condition = words.rpartition(":")
    if Path(file).is_file():
        return read_gait(file, condition=condition).to_json()
    return read_gait(words).to_json()


FILE_FLAGS = {"human": read_own_gait}
"""Settings whose flag is the name of a file, and what makes the setting of it."""


_JSON_FLAG = tyro.constructors.PrimitiveConstructorSpec(
    nargs=1,
    metavar="JSON|FILE",
    instance_from_str=_read_json,
    is_instance=lambda value: value is None or isinstance(value, dict),
    str_from_instance=lambda value: [json.dumps(value)],
)


def _metavar(kind: Any) -> str:
    """How a value of this type is written on the command line."""
    parts = get_args(kind)
    if get_origin(kind) is Literal:
        return "|".join(map(str, parts))
    if get_origin(kind) is tuple:
        return f"{_metavar(parts[0])} ..." if parts[1:] == (...,) else " ".join(map(_metavar, parts))
    parts = [part for part in parts if part is not type(None)]
    return "|".join(map(_metavar, parts)) if parts else kind.__name__.upper()


def optional_flags(name: str, settings: type, defaults: Any, leave_out: tuple[str, ...] = ()) -> type:
    """A dataclass with every field of `settings` as an optional flag: None, its default, means "not given".

    The help of each flag is the field's own docstring, with its value in `defaults` (an instance).
    """
    help_of, flags = _field_help(settings), []
    for item_name, kind in get_type_hints(settings).items():
        if item_name in leave_out:
            continue
        default = getattr(defaults, item_name)
        shown = " ".join(map(str, default)) if isinstance(default, tuple) else default
        hint = f"(default: {shown})"
        is_json = dict in (get_origin(kind), *map(get_origin, get_args(kind)))
        if item_name in FILE_FLAGS:
            annotation = Annotated[
                str | None, tyro.conf.arg(help=help_of[item_name], help_behavior_hint=hint, metavar="FILE")
            ]
        elif is_json:
            annotation = Annotated[
                dict | None, _JSON_FLAG, tyro.conf.arg(help=help_of[item_name], help_behavior_hint=hint)
            ]
        else:
            annotation = Annotated[
                kind | None,
                tyro.conf.arg(help=help_of[item_name], help_behavior_hint=hint, metavar=_metavar(kind)),
            ]
        flags.append((item_name, annotation, None))
    return dataclasses.make_dataclass(
        name,
        flags,
        frozen=True,
        kw_only=True,
        namespace={"__doc__": settings.__doc__, "__module__": __name__},
    )


def given(flags: Any) -> dict[str, Any]:
    """The flags that were given, by name, files read; raises `SpringfootError` for a bad file."""
    values = {item.name: getattr(flags, item.name) for item in dataclasses.fields(flags)}
    given_ones = {name: value for name, value in values.items() if value is not None}
    return given_ones | {name: read(given_ones[name]) for name, read in FILE_FLAGS.items() if name in given_ones}


SettingsFlags = optional_flags("SettingsFlags", BipedSettings, BipedSettings())
"""Every environment setting as an optional flag (dataclass for `tyro`)."""
