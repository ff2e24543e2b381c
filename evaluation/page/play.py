"""Write play.html: recorded walks, between which sliders blend; one file that opens offline."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..recording.recording import Recording
from .play_data import PANELS, drawn_body, packed, people_behind, walk_of
from .template import as_json, filled


class Grid(NamedTuple):
    """Points at which walks are recorded: all combinations, the last axis fastest."""

    feet: Sequence[str]
    """Kinds of the right foot."""
    speed: Sequence[float]
    """Commanded speeds [m/s]."""
    toe: Sequence[float]
    """Factors on K of the toes."""
    ankle: Sequence[float]
    """Factors on K of the ankles."""

    @property
    def size(self) -> int:
        """Number of combinations."""
        return len(self.feet) * len(self.speed) * len(self.toe) * len(self.ankle)


class PlayPage(NamedTuple):
    """A page, and the numbers of its walks."""

    text: str
    """HTML."""
    numbers: list[dict[str, Any]]
    """Numbers of each walk, as `play_data.walk_of`."""


def play_page(grid: Grid, recordings: Sequence[Recording], subject: str, command: str) -> PlayPage:
    """Return the page of `recordings`, one for each combination of `grid` in its order.

    `subject` describes the recordings in a sentence; `command` is the one that made the page.
    """
    numbers, series = zip(*map(walk_of, recordings), strict=True)
    # Recordings from one foot, or one speed of a foot, to the next; one of each shows the body, or people, for all.
    walks_a_foot = len(recordings) // len(grid.feet)
    walks_a_speed = walks_a_foot // len(grid.speed)
    # The sliders begin in the middle; `pace` is the page's word for speed.
    middle = {"ankle": len(grid.ankle) // 2, "toe": len(grid.toe) // 2, "pace": len(grid.speed) // 2}
    data = {
        "grid": grid._asdict(),
        "begin": middle,
        "walks": numbers,
        "series": packed(series),
        "units": {title: unit for title, (_, unit, _) in PANELS.items()},
        "people": [people_behind(recordings[index * walks_a_speed]) for index in range(len(grid.speed))],
        "bodies": [drawn_body(recordings[index * walks_a_foot]) for index in range(len(grid.feet))],
        "what": f"{subject} Between these points, the marks of the sliders, the page blends what was recorded.",
        "made": command,
    }
    return PlayPage(filled("play.html", {"DATA": as_json(data)}), list(numbers))
