"""How far a training is, for a person who waits: a bar with the time left; without a terminal, plain lines."""

import sys
from time import monotonic
from types import TracebackType

from tqdm import tqdm

LINE_SECONDS = 20.0
"""Time between two plain lines [s]."""


class Progress:
    """Progress of `total` environment steps, `done` of which are behind us; a context manager."""

    def __init__(self, total: int, done: int = 0) -> None:
        self._bar = tqdm(
            total=total,
            initial=done,
            unit="step",
            unit_scale=True,
            dynamic_ncols=True,
            disable=not sys.stderr.isatty(),
        )
        self._total, self._first, self._done, self._state = total, done, done, ""
        self._began = self._last_line = monotonic()

    def advance(self, steps: int) -> None:
        """`steps` more steps are done."""
        self._done += steps
        self._bar.update(steps)
        if monotonic() - self._last_line > LINE_SECONDS:
            self._print_line()

    def report(self, state: str) -> None:
        """Shows how good the policy now is, in a few words, beside the bar or in a line."""
        self._state = state
        self._bar.set_postfix_str(state)
        self._print_line()

    def _print_line(self) -> None:
        if self._bar.disable:
            self._last_line = monotonic()
            rate = (self._done - self._first) / max(self._last_line - self._began, 1e-9)
            missing = max(self._total - self._done, 0)
            left = f"{tqdm.format_interval(missing / rate)} left" if rate and missing else ""
            parts = f"{self._done:,} of {self._total:,} steps", self._state, left
            print(" · ".join(part for part in parts if part), file=sys.stderr, flush=True)

    def __enter__(self) -> "Progress":
        """Starts the clock."""
        self._began = self._last_line = monotonic()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leaves the bar as it stands."""
        self._bar.close()
