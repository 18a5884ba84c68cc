"""Independent parts of a stage: computed by processes here or by any executor, and kept until its outputs are written.

A part that is kept is not computed again, so that a run that was killed goes on, and a stage takes what a cluster has
computed for it before (`flows.fan_out`).
"""

from __future__ import annotations

import os
import pickle
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from threadpoolctl import threadpool_limits

from reproduction.layout import Layout
from reproduction.pools import worker_pool
from reproduction.scratch import scratch_folder
from robojoule.documents import atomic_path

Result = TypeVar("Result")


@dataclass(frozen=True)
class Parts:
    """Where the parts of a stage are computed and kept.

    Attributes:
        folder: Where finished ones are kept; nowhere if not given.
        executor: Computes them, as `concurrent.futures` has it; processes here if not given.
        workers: How many processes; 1: this one.
    """

    folder: Path | None = None
    executor: Executor | None = None
    workers: int = 1

    @classmethod
    def of_stage(
        cls,
        stage: str,
        layout: Layout,
        params: Mapping[str, object],
        inputs: Iterable[bytes] = (),
        executor: Executor | None = None,
    ) -> Parts:
        """Parts of a stage, kept by code, versions, parameters and inputs.

        Args:
            stage: Its name.
            layout: Folder of the project.
            params: Its parameters, as plain data.
            inputs: The content of what it reads.
            executor: Computes them; one process for each processor if not given.

        Raises:
            InputError: Nothing can be written there.
        """
        return cls(scratch_folder(layout.scratch_dir / stage, params, inputs), executor, os.cpu_count() or 1)

    def map(
        self,
        function: Callable[..., Result],
        tasks: Sequence[tuple[object, ...]],
        done: Callable[[int, Result], None] = lambda number, result: None,
    ) -> list[Result]:
        """Results of a function for some tasks, in their order.

        Args:
            function: One that other processes can load; its name tells its parts from those of others.
            tasks: Arguments of each call.
            done: Is told number and result of each that is finished, as they come.
        """
        found: dict[int, Result] = {}
        for number in range(len(tasks)):
            if (path := self._path(function, number)) is not None and path.exists():
                # Written by the code that reads it, into a folder whose owner can change that code as well.
                found[number] = pickle.loads(path.read_bytes())
                done(number, found[number])
        missing = [number for number in range(len(tasks)) if number not in found]
        for number, result in self._computed(function, tasks, missing):
            if (path := self._path(function, number)) is not None:
                with atomic_path(path) as temporary:
                    temporary.write_bytes(pickle.dumps(result))
            found[number] = result
            done(number, result)
        return [found[number] for number in range(len(tasks))]

    def _path(self, function: Callable[..., Result], number: int) -> Path | None:
        return None if self.folder is None else self.folder / f"{function.__name__}-{number:04d}.part"

    def _computed(
        self, function: Callable[..., Result], tasks: Sequence[tuple[object, ...]], missing: Sequence[int]
    ) -> Iterable[tuple[int, Result]]:
        """Number and result of missing parts, as they come."""
        executor, workers = self.executor, min(self.workers, len(missing))
        with ExitStack() as stack:
            if executor is None and workers > 1:
                executor = stack.enter_context(worker_pool(workers))
            if executor is None:
                for number in missing:
                    yield number, _one_thread(function, *tasks[number])
                return
            futures: dict[Future[Result], int] = {
                executor.submit(_one_thread, function, *tasks[number]): number for number in missing
            }
            for future in as_completed(futures):
                yield futures[future], future.result()

    def forget(self) -> None:
        """Remove what was kept, now that the outputs made of it are written."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


HERE = Parts()
"""One after another in this process, and not kept."""


def _one_thread(function: Callable[..., Result], *task: object) -> Result:
    with threadpool_limits(1):  # sums of a matrix product depend on the number of threads
        return function(*task)
