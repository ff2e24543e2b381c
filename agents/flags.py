"""Command-line flags made from dataclasses of settings: their names, types and help stand once, in the dataclass."""

import ast
import dataclasses
import inspect
import json
import textwrap
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import tyro

from springfoot.envs.feet import FOOT_SETTINGS
from springfoot.envs.settings import CONDITION_SETTINGS, THEME_OF, THEMES, BipedSettings
from springfoot.gait.errors import quoted
from springfoot.gait.foot_file import read_foot
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
        try:
            text = Path(text).read_text(encoding="utf-8")
        except (OSError, ValueError):
            raise ValueError(f"{quoted(text)} is neither JSON text in braces nor the name of a JSON file") from None
    try:
        value = json.loads(text)
    except RecursionError:
        raise ValueError("the JSON is nested too deeply") from None
    if not isinstance(value, dict):
        raise ValueError("the JSON must be an object in braces")
    return value


def read_own_gait(words: str, trust_units: bool = False) -> dict[str, Any]:
    """The setting `human` from what `--human` is given; `trust_units` as in `read_gait`.

    A file of `read_gait`; FILE:CONDITION for one of several in a CSV; several files of one walk with commas between.
    Raises `SpringfootError` for a file that cannot be read.
    """
    if Path(words).is_file():
        return read_gait(words, trust_units=trust_units).to_json()
    if "," in words:
        return read_gait(*words.split(","), trust_units=trust_units).to_json()
    file, _, condition = words.rpartition(":")
    if Path(file).is_file():
        return read_gait(file, condition=condition, trust_units=trust_units).to_json()
    return read_gait(words, trust_units=trust_units).to_json()


def _read_word_or_json(words: list[str]) -> str | dict[str, Any]:
    """A word as it is, a name of a file too; a dictionary from JSON text."""
    return _read_json(words) if words[0].lstrip().startswith("{") else words[0]


def _foot(given: str | dict[str, Any]) -> str | dict[str, Any]:
    """A foot as it is, or that of the file of that name."""
    return read_foot(given) if isinstance(given, str) and Path(given).is_file() else given


FILE_FLAGS = {"human": read_own_gait}
"""Settings whose flag is the name of a file, and what makes the setting of it."""


TRUST = "trust_units"
"""Flag beside those of files: take them as they are."""
_TRUST_FLAG = Annotated[
    tyro.conf.FlagCreatePairsOff[bool],
    tyro.conf.arg(help="Take the file of --human as it is, even if its units or signs look wrong."),
]
_JSON_FLAG = tyro.constructors.PrimitiveConstructorSpec(
    nargs=1,
    metavar="JSON|FILE",
    instance_from_str=_read_json,
    is_instance=lambda value: value is None or isinstance(value, dict),
    str_from_instance=lambda value: [json.dumps(value)],
)


_WORD_FLAG = tyro.constructors.PrimitiveConstructorSpec(
    nargs=1,
    metavar="WORD|JSON|FILE",
    instance_from_str=_read_word_or_json,
    is_instance=lambda value: value is None or isinstance(value, (str, dict)),
    str_from_instance=lambda value: [value if isinstance(value, str) else json.dumps(value)],
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


def optional_flags(
    name: str, settings: type, defaults: Any, leave_out: tuple[str, ...] = (), themes: Mapping[str, str] = THEMES
) -> type:
    """A dataclass with every field of `settings` as an optional flag: None, its default, means "not given".

    The help of each flag is the docstring of the field, with its value in `defaults` (an instance). Fields that name a
    theme become flags of a dataclass inside, one for each theme, which `--help` shows as a group with the text that
    `themes` has for it.
    """
    help_of, flags, themed = _field_help(settings), [], {theme: [] for theme in themes}
    hints, metadata = get_type_hints(settings), {item.name: item.metadata for item in dataclasses.fields(settings)}
    for item_name, kind in hints.items():
        if item_name not in leave_out:
            annotation = _optional_flag(item_name, kind, help_of[item_name], getattr(defaults, item_name))
            its_group = themed.get(metadata[item_name].get("theme", ""), flags)
            its_group.append((item_name, annotation, None))
            if item_name in FILE_FLAGS:
                its_group.append((TRUST, _TRUST_FLAG, False))
    for theme, inside in themed.items():
        if inside:
            group = _flags_class(f"{name}{theme.title()}", inside, themes[theme])
            flags.append((theme, tyro.conf.OmitArgPrefixes[group], dataclasses.field(default_factory=group)))
    return _flags_class(name, flags, settings.__doc__)


def _flags_class(name: str, flags: list[tuple[str, Any, Any]], doc: str | None) -> type:
    namespace = {"__doc__": doc, "__module__": __name__}
    return dataclasses.make_dataclass(name, flags, frozen=True, kw_only=True, namespace=namespace)


def _optional_flag(name: str, kind: Any, text: str, default: Any) -> Any:
    """The annotation of a flag for a setting of this type, with its help and the default that is shown."""
    shown = " ".join(map(str, default)) if isinstance(default, tuple) else default
    hint = f"(default: {shown})"
    if name == "human":
        return Annotated[str | None, tyro.conf.arg(help=text, help_behavior_hint=hint, metavar="FILE")]
    parts = get_args(kind)
    if dict in (get_origin(kind), *map(get_origin, parts)):
        if str in parts and get_origin(kind) is not dict:
            return Annotated[str | dict | None, _WORD_FLAG, tyro.conf.arg(help=text, help_behavior_hint=hint)]
        return Annotated[dict | None, _JSON_FLAG, tyro.conf.arg(help=text, help_behavior_hint=hint)]
    return Annotated[kind | None, tyro.conf.arg(help=text, help_behavior_hint=hint, metavar=_metavar(kind))]


def given(flags: Any) -> dict[str, Any]:
    """The flags that were given, by name, themes aside and files read; raises `SpringfootError` for a bad file."""
    values: dict[str, Any] = {}
    for item in dataclasses.fields(flags):
        value = getattr(flags, item.name)
        if dataclasses.is_dataclass(value):
            values |= given(value)
        elif item.name in FILE_FLAGS and value is not None:
            values[item.name] = FILE_FLAGS[item.name](value, getattr(flags, TRUST))
        elif item.name != TRUST and value is not None:
            values[item.name] = _foot(value) if item.name in FOOT_SETTINGS else value
    return values


def _evaluated(theme: str) -> str:
    """The help of a theme in an evaluation: which of its settings a trained policy brings with it."""
    names = [name for name, its in THEME_OF.items() if its == theme and name != "episode_seconds"]  # given as --seconds
    own = [f"--{name.replace('_', '-')}" for name in names if name not in CONDITION_SETTINGS]
    if len(own) == len(names):
        return f"{THEMES[theme]} A trained policy brings its own."
    return f"{THEMES[theme]} Of these a trained policy brings {' and '.join(own) or 'nothing'} with it."


SettingsFlags = optional_flags(
    "SettingsFlags", BipedSettings, BipedSettings(), themes={theme: _evaluated(theme) for theme in THEMES}
)
"""Every environment setting as an optional flag, of an evaluation, in groups by theme (dataclass for `tyro`)."""
