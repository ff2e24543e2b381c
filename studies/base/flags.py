"""Make command-line flags from dataclasses of settings, where name, type and help of each flag stand once."""

import ast
import dataclasses
import inspect
import json
import textwrap
from collections.abc import Mapping
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import tyro

from springfoot.envs.settings import CONDITION_SETTINGS, FOOT_SETTINGS, THEME_OF, THEMES, BipedSettings
from springfoot.errors import quoted
from springfoot.files.json_file import json_fault, keys_once, read_object
from springfoot.gait.people import read_gait
from springfoot.gait.springs import StiffnessSchedule, read_foot

from .flag_words import NOT_GIVEN, flag_of, spec


def field_help(settings: type) -> dict[str, str]:
    """Return the docstring below each field of a dataclass, on one line."""
    body = ast.parse(textwrap.dedent(inspect.getsource(settings))).body[0].body  # type: ignore[attr-defined]
    return {
        item.target.id: " ".join(str(doc.value.value).split())
        for item, doc in pairwise(body)
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and isinstance(doc, ast.Expr)
        and isinstance(doc.value, ast.Constant)
    }


def read_json(words: list[str]) -> dict[str, Any]:
    """Return a dictionary from JSON text, or from the JSON file of that name."""
    text = words[0]
    if not text.lstrip().startswith("{"):
        if not Path(text).is_file():
            raise ValueError(f"must be JSON text in braces or the name of a JSON file, got {quoted(text)}")
        return read_object(Path(text), "setting in JSON")
    try:
        value = json.loads(text, object_pairs_hook=keys_once)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"must be JSON, but {json_fault(error)}: {quoted(text)}") from None
    return value


def read_own_gait(words: str, trust_units: bool = False, mass: float | None = None) -> dict[str, Any]:
    """Return the setting `human` for the value of `--human`; `trust_units` as in `read_gait`.

    The value is a file of `read_gait`; FILE:CONDITION for one condition of a CSV; or several files of one walk with
    commas between. Moments in N m are divided by the mass that the forces bear; in files without forces by `mass` [kg],
    that of the body. Raises `SpringfootError` for a file that cannot be read.
    """
    files = [words]
    condition = None
    if not Path(words).is_file():
        file, _, last = words.rpartition(":")
        if "," in words:
            files = words.split(",")
        elif Path(file).is_file():
            files = [file]
            condition = last
    own = read_gait(*files, condition=condition, trust_units=trust_units)
    if mass is not None and "grf_vertical" not in own.mean:
        own = read_gait(*files, condition=condition, trust_units=trust_units, mass=mass)
    return own.to_json()


def _read_json_or_none(may_be_none: bool, words: list[str]) -> dict[str, Any] | None:
    return None if may_be_none and words == ["None"] else read_json(words)


def _read_word_or_json(words: list[str]) -> str | dict[str, Any]:
    """Return a dictionary from JSON text, or the word itself, which may name a file."""
    return read_json(words) if words[0].lstrip().startswith("{") else words[0]


def foot_given(given: str | dict[str, Any]) -> str | dict[str, Any]:
    """Return the foot setting for a flag's value: the foot of that file if the value is a file's name, else the
    value."""
    if isinstance(given, str) and (Path(given).is_file() or Path(given).suffix):
        return read_foot(given)
    return given


FootFlag = Annotated[str | dict[str, Any], spec(_read_word_or_json, "WORD|JSON|FILE")]
"""Type of a flag for a foot; `foot_given` converts its value to a setting."""
FILE_FLAGS = {"human": read_own_gait}
"""Setting whose flag is a file's name -> function that reads the setting from the file."""


TRUST = "trust_units"
"""Flag beside flags of files: skip the check of units and signs."""
_TRUST_FLAG = Annotated[
    tyro.conf.FlagCreatePairsOff[bool],
    tyro.conf.arg(help="Take the file of --human as it is, even if its units or signs look wrong."),
]


def optional_flags(
    name: str,
    settings: type,
    defaults: Any,
    leave_out: tuple[str, ...] = (),
    themes: Mapping[str, str] = THEMES,
    refused: Mapping[str, str] = MappingProxyType({}),
) -> type:
    """Return a dataclass with every field of `settings` as an optional flag, whose default is `NOT_GIVEN`.

    Args:
        name: of the dataclass.
        settings: dataclass of the fields; the help of a flag is the docstring of its field.
        defaults: instance of `settings`; the help shows its values.
        leave_out: fields that become no flag.
        themes: theme -> help text. Fields with a theme become flags of an inner dataclass, a group of `--help`.
        refused: field -> reason, for fields that the command refuses; their help gives the reason.
    """
    help_of = field_help(settings)
    flags = []
    themed = {theme: [] for theme in themes}
    hints = get_type_hints(settings)
    metadata = {item.name: item.metadata for item in dataclasses.fields(settings)}
    for item_name, kind in hints.items():
        if item_name not in leave_out:
            shown = help_of[item_name], f"(default: {_words(getattr(defaults, item_name))})"
            if item_name in refused:
                shown = f"Refused: {refused[item_name]}.", ""
            annotation = _optional_flag(item_name, kind, *shown)
            its_group = themed.get(metadata[item_name].get("theme", ""), flags)
            its_group.append((item_name, annotation, NOT_GIVEN))
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


def _words(default: Any) -> Any:
    return " ".join(map(str, default)) if isinstance(default, tuple) else default


def _optional_flag(name: str, kind: Any, text: str, hint: str) -> Any:
    """Return the annotation of a flag for a setting of type `kind`, with its help `text` and the `hint` behind it."""
    parts = get_args(kind)
    if name in FILE_FLAGS:
        how = spec(lambda words: words[0], "FILE")
    elif name in FOOT_SETTINGS:
        how = spec(_read_word_or_json, "WORD|JSON|FILE")
    elif get_origin(kind) is not dict and StiffnessSchedule not in parts:
        how = flag_of(kind)
    else:
        how = spec(partial(_read_json_or_none, NoneType in parts), "JSON|FILE")
    return Annotated[Any, how, tyro.conf.arg(help=text, help_behavior_hint=hint)]


def given(flags: Any) -> dict[str, Any]:
    """Return name -> value of the flags that the user gave, without themes, with files read.

    Raises `SpringfootError` for a bad file.
    """
    values = _given_words(flags)
    trust = values.pop(TRUST, False)
    for name in values.keys() & {*FOOT_SETTINGS}:
        values[name] = foot_given(values[name])
    for name in values.keys() & FILE_FLAGS.keys():
        values[name] = FILE_FLAGS[name](values[name], trust, values.get("mass"))
    return values


def _given_words(flags: Any) -> dict[str, Any]:
    """Return name -> value of the flags that the user gave, and `TRUST`, without themes."""
    values: dict[str, Any] = {}
    for item in dataclasses.fields(flags):
        value = getattr(flags, item.name)
        if dataclasses.is_dataclass(value):
            values |= _given_words(value)
        elif value is not NOT_GIVEN:
            values[item.name] = value
    return values


def _evaluated(theme: str) -> str:
    """Return the help of a theme in an evaluation: the settings of the theme that a trained policy brings with it."""
    names = [name for name, its in THEME_OF.items() if its == theme and name != "episode_seconds"]  # given as --seconds
    own = [f"--{name.replace('_', '-')}" for name in names if name not in CONDITION_SETTINGS]
    if len(own) == len(names):
        return f"{THEMES[theme]} A trained policy brings its own."
    return f"{THEMES[theme]} Of these a trained policy brings {' and '.join(own) or 'nothing'} with it."


EVALUATED = {theme: _evaluated(theme) for theme in THEMES}
"""Theme -> its help in an evaluation."""
SettingsFlags = optional_flags("SettingsFlags", BipedSettings, BipedSettings(), themes=EVALUATED)
"""Every environment setting as an optional flag of an evaluation, in groups by theme (dataclass for `tyro`)."""
