"""The first signal asks a training to stop, the second interrupts it, and the handlers from before are back."""

import signal

import pytest

from springfoot.agents.training.signals import Stopping
from springfoot.terminal import ENDING


def handlers():
    return [signal.getsignal(number) for number in ENDING]


def test_the_first_signal_asks_and_the_second_interrupts():
    before = handlers()
    with Stopping() as stopping:
        assert not stopping.asked and stopping.signal is None
        signal.raise_signal(signal.SIGTERM)
        assert stopping.asked and stopping.signal is signal.SIGTERM
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert handlers() == before
    assert stopping.signal is signal.SIGINT
    assert handlers() == before


def test_a_second_signal_while_handlers_are_restored_leaves_none_of_its_own(monkeypatch):
    before = handlers()
    set_handler = signal.signal
    signals = iter([signal.SIGTERM])

    def interrupted(number, handler):
        for second in signals:
            signal.raise_signal(second)
        return set_handler(number, handler)

    stopping = Stopping().__enter__()
    signal.raise_signal(signal.SIGINT)
    monkeypatch.setattr(signal, "signal", interrupted)
    with pytest.raises(KeyboardInterrupt):
        stopping.__exit__(None, None, None)
    assert handlers() == before
