"""An executor of `concurrent.futures` whose calls are tasks of Prefect: what takes one needs to know none of it."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from concurrent.futures import Executor, Future
from threading import Thread
from typing import Any

from prefect import task
from prefect.cache_policies import NO_CACHE
from prefect.context import FlowRunContext
from prefect.futures import PrefectFuture

from robojoule.errors import InputError, RobojouleError


def _worth_a_retry(_task: Any, _run: Any, state: Any) -> bool:
    """Retry after a fault of a machine, such as a worker that is gone, never after bad input."""
    return not isinstance(state.result(raise_on_failure=False), InputError)


@task(
    name="call",
    retries=1,
    retry_delay_seconds=1,
    retry_condition_fn=_worth_a_retry,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def call(pickled: bytes) -> bytes:
    """Call a function; call and result are pickled here, as engines and Prefect look into what they are given."""
    function, arguments, named = pickle.loads(pickled)
    return pickle.dumps(function(*arguments, **named))


class TaskExecutor(Executor):
    """An executor whose calls are tasks on the runner of the flow in which it is used.

    Raises:
        RobojouleError: It is made outside of a flow.
    """

    def __init__(self) -> None:
        if FlowRunContext.get() is None:
            raise RobojouleError("tasks are executed within a flow only")

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """See `concurrent.futures.Executor`."""
        future: Future[Any] = Future()
        future.set_running_or_notify_cancel()
        started = call.submit(pickle.dumps((fn, args, kwargs)))
        Thread(target=_await, args=(started, future), daemon=True).start()
        return future


def _await(started: PrefectFuture[bytes], future: Future[Any]) -> None:
    try:
        future.set_result(pickle.loads(started.result()))
    except BaseException as error:  # what the call raised goes to who asks for its result
        future.set_exception(error)
