"""Give settings of feet that several studies walk on."""

from typing import Any

from springfoot.envs.settings import FOOT_SETTINGS


def both(foot: Any) -> dict[str, Any]:
    """Return the settings of a walk on two of the same `foot`."""
    return dict.fromkeys(FOOT_SETTINGS, foot)


def braced(**numbers: Any) -> dict[str, Any]:
    """Return a sound foot in an orthosis of those numbers."""
    return {"kind": "intact", "orthosis": numbers}
