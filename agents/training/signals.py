"""Stop a training in good order at the first SIGINT or SIGTERM, and at once at the second."""

import signal
import threading
from types import TracebackType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that stop a training."""


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
            self._restore()  # a third signal meets the handlers from before
            raise KeyboardInterrupt

    def ask(self) -> None:
        """Request to stop, without a signal."""
        self.asked = True

    def _restore(self) -> None:
        """Restore the signal handlers that stood before the block."""
        for number, handler in self._handlers_before.items():
            signal.signal(number, handler)

    def __enter__(self) -> "Stopping":
        """Handle the signals, which Python allows in the main thread only."""
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                self._handlers_before[number] = signal.signal(number, self._stop)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the earlier handling of the signals."""
        self._restore()
