"""Batches out, rows back, whatever becomes of the workers in between."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait

from convexrough.errors import WorkerError
from convexrough.sweeps.batch import VERSIONS, Batch, Rows, different, refused
from convexrough.sweeps.engines import Engine

#: Batches may be lost so often without any coming back: a scene that kills its worker is found
#: among a thousand after ten times.
MOST_LOST = 60

#: Seconds that workers have to give back what they have after an interrupt.
GRACE = 30.0


class Work:
    """Batches computed by one engine.

    A batch whose worker died is cut in two, so that a scene that kills is found. It has failed if
    that happens again while it is all that is computed.
    """

    def __init__(self, batches: Iterable[Batch], engine: Engine) -> None:
        self._new, self._engine = iter(batches), engine
        self._again: deque[Batch] = deque()
        self._suspects: deque[Batch] = deque()
        self._alone: Batch | None = None
        self._pending: dict[Future[Rows], Batch] = {}
        self._lost = 0

    def rows(self) -> Iterator[Rows]:
        """As they come; together they are those of all scenes, each once.

        An interrupt comes through after what was computed until then. Raises WorkerError.
        """
        try:
            while self._hand_out():
                done, _ = wait(self._pending, return_when=FIRST_COMPLETED)
                for future in done:
                    yield from self._taken(future)
        except KeyboardInterrupt:
            yield from self._rescued()
            raise
        finally:
            for future in self._pending:
                future.cancel()

    def _hand_out(self) -> bool:
        """Give out batches; False where all are back."""
        while len(self._pending) < self._engine.at_once():
            if (batch := self._next()) is None:
                break
            try:
                future = self._engine.submit(batch)
            except self._engine.lost as error:
                if not self._engine.renew():
                    raise WorkerError(f"the executor is of no use any more: {error}") from error
                future = self._engine.submit(batch)
            self._pending[future] = batch
        return bool(self._pending)

    def _next(self) -> Batch | None:
        if self._again:
            return self._again.popleft()
        if (fresh := next(self._new, None)) is not None:
            return fresh
        if self._suspects and not self._pending:
            self._alone = self._suspects.popleft()
            return self._alone
        return None

    def _taken(self, future: Future[Rows]) -> Iterator[Rows]:
        """What came back; what did not is put where it will be computed again."""
        batch = self._pending.pop(future)
        try:
            rows = future.result()
        except self._engine.lost as error:
            self._lost += 1
            if self._lost > MOST_LOST:
                raise WorkerError(f"workers die as soon as they are there: {error}") from error
            yield from self._put_back(batch)
            return
        except CancelledError as error:
            raise WorkerError("the engine dropped a batch: is its scheduler gone?") from error
        if rows.versions != VERSIONS:
            raise WorkerError(f"a worker has other versions: {different(rows.versions)}")
        self._lost = 0
        if len(rows):
            yield rows
        if rows.stop < batch.stop:
            self._again.appendleft(batch.of(range(rows.stop, batch.stop)))

    def _put_back(self, batch: Batch) -> Iterator[Rows]:
        if batch is self._alone:
            yield refused(batch, "the process that computed it died, twice")
        elif len(batch.numbers) == 1:
            self._suspects.append(batch)
        else:
            middle = (batch.first + batch.stop) // 2
            self._again.append(batch.of(range(batch.first, middle)))
            self._again.append(batch.of(range(middle, batch.stop)))

    def _rescued(self) -> Iterator[Rows]:
        """After an interrupt: what workers have, if they can be told to give it back."""
        for future in self._pending:
            future.cancel()
        done, _ = wait(self._pending, timeout=GRACE if self._engine.stop() else 0.0)
        for future in done:
            if not future.cancelled() and future.exception() is None and len(future.result()):
                yield future.result()
