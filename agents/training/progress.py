"""Show the progress of a training: a bar with the time left, or plain lines without a terminal."""

import sys
from time import monotonic
from types import TracebackType

from tqdm import tqdm

LINE_SECONDS = 20.0
"""Time between two plain lines [s]."""


class Progress:
    """Show how many of `total` environment steps are done, `done` of them in earlier sessions; a context manager."""

    def __init__(self, total: int, done: int = 0) -> None:
        self._bar = tqdm(
            total=total,
            initial=done,
            unit="step",
            unit_scale=True,
            dynamic_ncols=True,
            disable=not sys.stderr.isatty(),
        )
        self._total = total
        self._done_before = done  # the rate is that of this session alone
        self._done = done
        self._state = ""
        self._began = self._last_line = monotonic()

    def advance(self, steps: int) -> None:
        """Count `steps` more steps."""
        self._done += steps
        self._bar.update(steps)
        if monotonic() - self._last_line > LINE_SECONDS:
            self._print_line()

    def report(self, state: str) -> None:
        """Show `state`, a few words on how good the policy is now, beside the bar or in a line."""
        self._state = state
        self._bar.set_postfix_str(state)
        self._print_line()

    def _print_line(self) -> None:
        """Print a line of progress if there is no bar."""
        if self._bar.disable:
            self._last_line = monotonic()
            seconds = max(self._last_line - self._began, 1e-9)  # no time may have passed
            rate = (self._done - self._done_before) / seconds  # [steps/s]
            remaining = max(self._total - self._done, 0)
            left = f"{tqdm.format_interval(remaining / rate)} left" if rate and remaining else ""
            parts = f"{self._done:,} of {self._total:,} steps", self._state, left
            print(" · ".join(part for part in parts if part), file=sys.stderr, flush=True)

    def __enter__(self) -> "Progress":
        """Start the clock."""
        self._began = self._last_line = monotonic()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the bar; it stays on the screen as it is."""
        self._bar.close()
