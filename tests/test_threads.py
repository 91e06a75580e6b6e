"""Work in several threads: all of it is done, errors are raised, and no thread is left."""

import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from threadpoolctl import threadpool_info

from convexrough import threads


def limits_of_threads() -> set[int]:
    import scipy.linalg  # noqa: F401  has linear algebra of its own

    return {each["num_threads"] for each in threadpool_info()}


def test_callers_in_several_threads_do_not_disturb_each_other() -> None:
    before, limits = threading.active_count(), limits_of_threads()

    def squares(_: int) -> list[int]:
        done: list[int] = []
        threads.each(lambda k: done.append(k * k), range(3), 3)
        return sorted(done)

    sys.setswitchinterval(1e-6)  # threads take turns at nearly every line
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(squares, range(1000)))
    sys.setswitchinterval(0.005)
    assert found == 1000 * [[0, 1, 4]]
    assert threading.active_count() == before
    assert limits_of_threads() == limits


@pytest.mark.parametrize("fails", [0, 9])
def test_an_error_of_any_thread_is_raised_when_no_thread_works_any_more(fails: int) -> None:
    started, ended = threading.Barrier(2, timeout=10), []

    def work(k: int) -> None:
        if k in (0, 9):
            started.wait()
        if k == fails:
            raise ZeroDivisionError
        ended.append(k)

    with threads.one_thread(), pytest.raises(ZeroDivisionError):
        threads.each(work, [0, 9, 1, 2, 3], 2)
    assert len(ended) == 4
