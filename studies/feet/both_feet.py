"""Give settings of feet that several studies walk on."""

from collections.abc import Mapping
from typing import Any

from springfoot.envs.settings import FOOT_SETTINGS


def both(foot: str | Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a walk with the foot setting `foot` on both sides."""
    return dict.fromkeys(FOOT_SETTINGS, foot)


def braced(**numbers: Any) -> dict[str, Any]:
    """Return the setting of a sound foot in an orthosis; `numbers` are the orthosis's, such as `ankle_stiffness`."""
    return {"kind": "intact", "orthosis": numbers}
