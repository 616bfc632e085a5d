"""Threads rest between kernels, and are all there within them."""

from __future__ import annotations

import pytest

from optics.kernels.backend import Float32, dr
from optics.workers.threads import resting_threads, woken_threads


@pytest.fixture(autouse=True)
def three_threads():
    before = dr.thread_count()
    dr.set_thread_count(3)
    yield
    dr.set_thread_count(before)


def test_threads_rest_but_in_kernels():
    with woken_threads():
        assert dr.thread_count() == 3
    with resting_threads():
        assert dr.thread_count() == 1
        with woken_threads():
            assert dr.thread_count() == 3
            with woken_threads():
                total = dr.sum(dr.arange(Float32, 1000))
            assert dr.thread_count() == 3
        assert dr.thread_count() == 1
        assert total[0] == 999 * 1000 / 2
    assert dr.thread_count() == 3


def test_threads_are_back_after_an_error():
    with pytest.raises(KeyError), resting_threads(), woken_threads():
        raise KeyError
    assert dr.thread_count() == 3
