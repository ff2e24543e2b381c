"""Read and change single entries of a foot in plain JSON values, for inputs that show one of them each.

The path of an entry is its place in the foot: `kind`, `ankle_stiffness`, `orthosis.ankle_deg`.
"""

from typing import Any

from springfoot.envs.physics.foot import WAYS
from springfoot.envs.settings.feet import ENGAGES, KINDS, ORTHOSIS_NUMBERS, SEGMENT_RATIOS, Number
from springfoot.gait.springs.stiffness import SPRINGS

PlainFoot = str | dict[str, Any]
"""A foot of the settings in plain JSON values."""
KIND, ORTHOSIS = "kind", "orthosis"
"""Paths of the kind, and of all numbers of an orthosis."""
WAY = f"{ORTHOSIS}.{ENGAGES}"
"""Path of the way in which an orthosis acts, one of `ORTHOSIS_WAYS`."""
BOTH_WAYS = "both ways"
ORTHOSIS_WAYS = (BOTH_WAYS, *WAYS)
"""Ways in which an orthosis may act."""
_NUMBERS: dict[str, Number] = {
    **{path: number for numbers in KINDS.values() for path, number in numbers.items()},
    **{f"{ORTHOSIS}.{name}": number for name, number in ORTHOSIS_NUMBERS.items()},
}
"""Default and allowed range of each number by its path."""


def range_of(path: str) -> tuple[float, float]:
    """Return the lowest and the highest allowed value of the number at `path`, in its unit."""
    number = _NUMBERS[path]
    return number.low, number.high


def entry_of(foot: PlainFoot, path: str) -> Any:
    """Return the entry of a foot at `path`; the usual number of a kind that has it, if the foot leaves it out."""
    entries = _entries(foot)
    if path == WAY:
        return entries.get(path) or BOTH_WAYS
    return entries[path] if path in entries else _NUMBERS[path].usual


def with_entry(foot: PlainFoot, path: str, value: Any) -> dict[str, Any]:
    """Return a copy of a foot with `value` as its entry at `path`; the copy is not checked.

    If the kind changes, only the entries of the orthosis and the segments' mass ratios stay.
    """
    entries = _entries(foot)
    if path == KIND and value != entries[KIND]:
        entries = {key: entry for key, entry in entries.items() if key in SEGMENT_RATIOS or key.startswith(ORTHOSIS)}
    entries[path] = value
    if entries.get(WAY) in (None, BOTH_WAYS):
        entries.pop(WAY, None)
    return _foot_from(entries)


def has_entry(foot: PlainFoot, path: str) -> bool:
    """Return True if the entry at `path` does something on a foot of this kind.

    Numbers do nothing beside a torque-angle line or a schedule, and those of an orthosis without stiffness neither.
    """
    entries = _entries(foot)
    if path in (KIND, f"{ORTHOSIS}.ankle_stiffness"):
        return True
    if path.startswith(ORTHOSIS):
        joints = SPRINGS if path == WAY else ("ankle",)
        return any(entries.get(f"{ORTHOSIS}.{joint}_stiffness") for joint in joints)
    joint = path.partition("_")[0]
    return path in KINDS[entries[KIND]] and not entries.get(f"{joint}_table") and not entries.get("schedule")


def _entries(foot: PlainFoot) -> dict[str, Any]:
    """Return path -> value of the entries that a foot states; those of an orthosis begin with `orthosis.`."""
    plain: dict[str, Any] = {KIND: foot} if isinstance(foot, str) else dict(foot)
    orthosis: dict[str, Any] = plain.pop(ORTHOSIS, None) or {}
    return plain | {f"{ORTHOSIS}.{name}": value for name, value in orthosis.items()}


def _foot_from(entries: dict[str, Any]) -> dict[str, Any]:
    """Return the foot with these entries (path -> value), in plain JSON values; the inverse of `_entries`."""
    start = f"{ORTHOSIS}."
    foot = {path: value for path, value in entries.items() if not path.startswith(start)}
    orthosis = {path.removeprefix(start): value for path, value in entries.items() if path.startswith(start)}
    return foot | {ORTHOSIS: orthosis} if orthosis else foot
