"""Make command-line flags from dataclasses of settings, where name, type and help of each flag stand once."""

import dataclasses
import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import tyro

from springfoot.command_line import field_help
from springfoot.envs.settings import CONDITION_SETTINGS, DRAWN_SETTINGS, FOOT_SETTINGS, THEME_OF, THEMES, BipedSettings
from springfoot.errors import SpringfootError, quoted
from springfoot.files.json_file import json_fault, keys_once, read_array, read_object
from springfoot.gait.people import read_gait
from springfoot.gait.springs import StiffnessSchedule, read_foot

from .flag_words import NOT_GIVEN, flag_of, reader_of_words


def read_json(words: list[str], opening: str = "{") -> Any:
    """Return a dictionary, or with the `opening` bracket a list, from the first of `words`: JSON text, or the name of a
    JSON file.

    Raises `ValueError`, with the fault, for any other word.
    """
    text = words[0]
    form, read_file = {"{": ("braces", read_object), "[": ("brackets", read_array)}[opening]
    if not text.lstrip().startswith(opening):
        if not Path(text).is_file():
            raise ValueError(f"must be JSON text in {form} or the name of a JSON file, got {quoted(text)}")
        return read_file(Path(text), "setting in JSON")
    try:
        value = json.loads(text, object_pairs_hook=keys_once)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"must be JSON, but {json_fault(error)}: {quoted(text)}") from None
    return value


def read_own_gait(words: str, trust_units: bool = False, mass: float | None = None) -> dict[str, Any]:
    """Return the setting `human` for the value of `--human`; `trust_units` as in `read_gait`.

    The value is a file of `read_gait`; FILE:CONDITION for one condition of a CSV; or several files of one walk with
    commas between. Moments in N m are divided by the mass that the forces show; in files without forces by `mass` [kg],
    that of the body. Raises `SpringfootError` for a file that cannot be read.
    """
    files, condition = files_of(words)
    gait = read_gait(*files, condition=condition, trust_units=trust_units)
    if mass is not None and "grf_vertical" not in gait.mean:
        gait = read_gait(*files, condition=condition, trust_units=trust_units, mass=mass)
    return gait.to_json()


def files_of(words: str) -> tuple[list[str], str | None]:
    """Return the file names in a word such as FILE, FILE,FILE or FILE:CONDITION, and the condition; None without one.

    FILE:CONDITION picks one of several gaits in a CSV over percent.
    """
    if not Path(words).is_file():
        file, _, after_colon = words.rpartition(":")
        if "," in words:
            return words.split(","), None
        if Path(file).is_file():
            return [file], after_colon
    return [words], None


def _read_json_or_none(may_be_none: bool, words: list[str], opening: str = "{") -> Any:
    """Return None for the word `None` if that is allowed, else the dictionary or list of `read_json`."""
    return None if may_be_none and words == ["None"] else read_json(words, opening)


def _read_word_or_json(words: list[str]) -> str | dict[str, Any]:
    """Return a dictionary from JSON text, or the word itself, which may name a file."""
    return read_json(words) if words[0].lstrip().startswith("{") else words[0]


def foot_given(value: str | dict[str, Any]) -> str | dict[str, Any]:
    """Return the foot setting for a flag's value: the foot in the file if the value is a file's name, else the value
    itself."""
    # A word with a suffix is the name of a file, also of a missing one, for which `read_foot` raises.
    if isinstance(value, str) and (Path(value).is_file() or Path(value).suffix):
        return read_foot(value)
    return value


def read_foot_flag(words: str) -> str | dict[str, Any]:
    """Return the foot setting of a value of `--foot`: a kind's word, JSON text, or a file's name.

    Raises `SpringfootError` for text that is no JSON, and for a file that cannot be read.
    """
    try:
        return foot_given(_read_word_or_json([words]))
    except SpringfootError:
        raise  # it is a ValueError too
    except ValueError as error:
        raise SpringfootError(f"--foot {error}") from None


LIST_FLAGS = ("drawn_feet", "drawn_bodies")
"""Settings with a list in JSON as their flag."""
FILE_FLAGS = {"human": read_own_gait}
"""Setting with a file's name as its flag -> function that reads the setting from the file."""


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
    """Return a dataclass with every field of `settings` as an optional flag with the default `NOT_GIVEN`.

    Args:
        name: name of the returned dataclass.
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
            text = help_of[item_name]
            hint = f"(default: {_words(getattr(defaults, item_name))})"
            if item_name in refused:
                text = f"Refused: {refused[item_name]}."
                hint = ""
            group_flags = themed.get(metadata[item_name].get("theme", ""), flags)  # fields without a theme: no group
            group_flags.append((item_name, _optional_flag(item_name, kind, text, hint), NOT_GIVEN))
            if item_name in FILE_FLAGS:
                group_flags.append((TRUST, _TRUST_FLAG, False))
    for theme, group_flags in themed.items():
        if group_flags:
            group = _flags_class(f"{name}{theme.title()}", group_flags, themes[theme])
            flags.append((theme, tyro.conf.OmitArgPrefixes[group], dataclasses.field(default_factory=group)))
    return _flags_class(name, flags, settings.__doc__)


def _flags_class(name: str, flags: list[tuple[str, Any, Any]], doc: str | None) -> type:
    """Return the dataclass of flags (name, annotation, default), with the docstring `doc`."""
    namespace = {"__doc__": doc, "__module__": __name__}
    return dataclasses.make_dataclass(name, flags, frozen=True, kw_only=True, namespace=namespace)


def _words(default: Any) -> Any:
    """Return a default as the user would type it: a tuple as words."""
    return " ".join(map(str, default)) if isinstance(default, tuple) else default


def _optional_flag(name: str, kind: Any, text: str, hint: str) -> Any:
    """Return the annotation of a flag for a setting of type `kind`, with its help `text` and the `hint` behind it."""
    parts = get_args(kind)
    if name in FILE_FLAGS:
        reader = reader_of_words(lambda words: words[0], "FILE")
    elif name in FOOT_SETTINGS:
        reader = reader_of_words(_read_word_or_json, "WORD|JSON|FILE")
    elif name in LIST_FLAGS:
        reader = reader_of_words(partial(_read_json_or_none, True, opening="["), "JSON|FILE")
    elif get_origin(kind) is not dict and StiffnessSchedule not in parts:
        reader = flag_of(kind)
    else:
        reader = reader_of_words(partial(_read_json_or_none, NoneType in parts), "JSON|FILE")
    return Annotated[Any, reader, tyro.conf.arg(help=text, help_behavior_hint=hint)]


def given(flags: Any) -> dict[str, Any]:
    """Return setting -> value of the flags that the user gave, in one dictionary for all groups of help.

    Values that name a file are replaced by its content. Raises `SpringfootError` for a bad file.
    """
    values = _given_words(flags)
    trust = values.pop(TRUST, False)
    for name in values.keys() & {*FOOT_SETTINGS}:
        values[name] = foot_given(values[name])
    for name in values.keys() & FILE_FLAGS.keys():
        values[name] = FILE_FLAGS[name](values[name], trust, values.get("mass"))
    return values


def _given_words(flags: Any) -> dict[str, Any]:
    """Return flag -> value of the flags that the user gave, and `TRUST`, in one dictionary for all groups of help."""
    values: dict[str, Any] = {}
    for item in dataclasses.fields(flags):
        value = getattr(flags, item.name)
        if dataclasses.is_dataclass(value):
            values |= _given_words(value)
        elif value is not NOT_GIVEN:
            values[item.name] = value
    return values


def _evaluation_help(theme: str) -> str:
    """Return the help of a theme of settings in an evaluation; it lists the flags with values that a trained policy
    brings with it."""
    settings = [name for name, theme_of_name in THEME_OF.items() if theme_of_name == theme]
    settings = [name for name in settings if name != "episode_seconds"]  # the flag --seconds
    brought = [f"--{name.replace('_', '-')}" for name in settings if name not in CONDITION_SETTINGS]
    if len(brought) == len(settings):
        return f"{THEMES[theme]} A trained policy brings its own."
    return f"{THEMES[theme]} Of these a trained policy brings {' and '.join(brought) or 'nothing'} with it."


EVALUATED = {theme: _evaluation_help(theme) for theme in THEMES}
"""Theme -> its help in an evaluation."""
SettingsFlags = optional_flags("SettingsFlags", BipedSettings, BipedSettings(), themes=EVALUATED)
"""Every environment setting as an optional flag of an evaluation, in groups by theme (dataclass for `tyro`)."""
RecordedFlags = optional_flags(
    "RecordedFlags",
    BipedSettings,
    BipedSettings(),
    themes=EVALUATED,
    refused=dict.fromkeys(DRAWN_SETTINGS, "an evaluation is of one body at one speed in one world"),
)
"""`SettingsFlags` where `record` refuses the settings that draw; their help says so."""
