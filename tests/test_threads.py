"""Work in several threads: all of it is done, errors are raised, and a forked process can work."""

import multiprocessing
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info

from convexrough import threads


def squares(_: int = 0) -> list[int]:
    done: list[int] = []
    threads.each(lambda k: done.append(k * k), range(3), 3)
    return sorted(done)


def limits_of_threads() -> set[int]:
    import scipy.linalg  # noqa: F401  has linear algebra of its own

    return {each["num_threads"] for each in threadpool_info()}


def test_callers_in_several_threads_do_not_disturb_each_other() -> None:
    limits = limits_of_threads()

    def limited(k: int) -> tuple[list[int], set[int]]:
        with threads.one_thread():
            return squares(), limits_of_threads() if k % 100 == 0 else {1}

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # threads take turns at nearly every line
    try:
        with ThreadPoolExecutor(2) as pool:
            found = list(pool.map(limited, range(1000)))
    finally:
        sys.setswitchinterval(before)
    assert found == 1000 * [([0, 1, 4], {1})]
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

    with pytest.raises(ZeroDivisionError):
        threads.each(work, [0, 9, 1, 2, 3], 2)
    assert len(ended) == 4


def met() -> list[int]:
    """[0, 1] if two threads run at once."""
    meeting, found = threading.Barrier(2, timeout=10), list[int]()
    threads.each(lambda _: found.append(meeting.wait()), range(2), 2)
    return sorted(found)


def test_two_run_at_once_and_may_be_nested() -> None:
    assert met() == [0, 1]
    found = list[list[int]]()
    threads.each(lambda _: found.append(squares()), range(2), 2)
    assert found == [[0, 1, 4], [0, 1, 4]]


def fork() -> None:
    assert met() == [0, 1]
    with multiprocessing.get_context("fork").Pool(1) as child:
        assert child.apply_async(met).get(timeout=20) == [0, 1]


def end() -> None:
    def late() -> None:
        time.sleep(0.2)  # the first thread has ended
        print(squares())

    threading.Thread(target=late).start()


def output_of(name: str) -> str:
    """What this function prints, in a process of its own, without threads and handlers of this."""
    program = [sys.executable, "-c", f"import test_threads; test_threads.{name}()"]
    return subprocess.check_output(program, cwd=Path(__file__).parent, timeout=60, text=True)


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
def test_a_forked_process_makes_threads_of_its_own() -> None:
    assert output_of("fork") == ""


def test_work_is_done_after_the_first_thread_has_ended() -> None:
    assert output_of("end").split("\n")[0] == "[0, 1, 4]"
