"""Stop a training in good order at the first SIGINT or SIGTERM, and at once at the second."""

import signal
from types import TracebackType
from typing import Any

from springfoot.terminal import restore_signals, take_signals


class Stopping:
    """Note a request to stop, by a signal or by `ask`; a context manager, which sees signals in the main thread only.

    `asked` is True after a request, `signal` the signal of the request, if there was one.
    """

    def __init__(self) -> None:
        self.asked = False
        self.signal: signal.Signals | None = None
        self._handlers_before: dict[int, Any] = {}

    def _stop(self, number: int, _frame: Any) -> None:
        """Note the first signal; at the second, raise KeyboardInterrupt."""
        first = self.signal is None
        self.signal = signal.Signals(number)
        self.asked = True
        if not first:
            restore_signals(self._handlers_before)  # a third signal meets the handlers from before
            raise KeyboardInterrupt

    def ask(self) -> None:
        """Request to stop, without a signal."""
        self.asked = True

    def __enter__(self) -> "Stopping":
        """Handle the signals."""
        self._handlers_before = take_signals(self._stop)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the earlier handling of the signals."""
        restore_signals(self._handlers_before)
