"""Ctrl-C in the driver."""

from __future__ import annotations

import gc
import signal
import threading

import pytest

from cityflow.flow.interrupts import heard


def test_ctrl_c_within_the_garbage_collector_is_not_lost() -> None:
    def during(_phase: str, _info: dict[str, int]) -> None:
        gc.callbacks.remove(during)
        signal.raise_signal(signal.SIGINT)

    with heard() as check:
        check()
        gc.callbacks.append(during)
        gc.collect()
        with pytest.raises(KeyboardInterrupt):
            check()


def test_a_second_ctrl_c_raises_at_once_and_afterwards_all_is_as_before() -> None:
    before = signal.getsignal(signal.SIGINT)
    with heard():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_another_thread_has_no_signals() -> None:
    def work() -> None:
        with heard() as check:
            check()
            done.append(True)

    done: list[bool] = []
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [True]
