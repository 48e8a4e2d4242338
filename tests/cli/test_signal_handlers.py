import signal
from collections.abc import Iterator

import pytest

from handsteer.cli import signals
from handsteer.cli.running import signals_ignored

ENDING = ["SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGABRT", "SIGTSTP", "SIGUSR1"]


@pytest.fixture(autouse=True)
def handlers_as_before() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in signal.valid_signals()}
    yield
    for number, handler in before.items():
        if signal.getsignal(number) != handler:
            signal.signal(number, handler)


@pytest.mark.parametrize("name", ENDING)
def test_a_signal_interrupts_so_that_the_robot_is_stopped(name: str) -> None:
    """The guard: ``interrupt_on_signals``."""
    signals.interrupt_on_signals()
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.Signals[name])
    assert signals.were_raised()


def test_another_signal_does_not_interrupt_the_end_that_the_first_began() -> None:
    """The guard: ``_REPEAT_S``."""
    signals.interrupt_on_signals()
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM)
    for again in (signal.SIGTERM, signal.SIGINT):
        try:
            signal.raise_signal(again)
        except KeyboardInterrupt:
            pytest.fail("it was interrupted")


def test_none_of_them_interrupts_what_stops_the_robot() -> None:
    """The guard: ``signals_ignored``, as where a terminal is closed after Ctrl-C."""
    signals.interrupt_on_signals()
    with signals_ignored():
        for number in signals.ending():
            try:
                signal.raise_signal(number)
            except KeyboardInterrupt:
                pytest.fail(f"{number.name} interrupted it")
    assert not signals.were_raised()
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM)
