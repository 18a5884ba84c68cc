"""Task runners by name: what cannot be had is one sentence, before anything is started."""

import re
import socket
import sys

import pytest

from flows.runners import task_runner
from robojoule.errors import InputError, RobojouleError
from tests.conftest import free_port

NO_ADDRESSES = (
    *("tcp://", "[::1]", "::1:8786", "tcp://[::1:8786", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:99999", "127.0.0.1:-1"),
    *("tcp://a..b:80", f"tcp://{'a' * 64}:80", "TCP://127.0.0.1:1", "tcp:127.0.0.1:1", "://127.0.0.1:1"),
    *(
        "tcp://127.0.0.1:1/x",
        "tcp://user@127.0.0.1:1",
        " tcp://127.0.0.1:1",
        "127.0.0.1:1\n",
        "\x00:1",
        "127.0.0.1:\uff11",
    ),
)


@pytest.mark.parametrize(
    ("runner", "workers", "address", "message"),
    [
        ("cluster", 2, None, "unknown task runner 'cluster'; allowed: processes, threads, dask, ray"),
        ("threads", 0, None, "0 is not a number of workers; allowed: 1 or more"),
        ("processes", 2, "tcp://host:8786", "'processes' works on this machine; allowed: dask or ray"),
        ("dask", 2, "nowhere", "'nowhere' is not the address of a Dask cluster; allowed: such as tcp://127.0.0.1:8786"),
        ("dask", 2, "tcp://host:port", "'tcp://host:port' is not the address of a Dask cluster"),
        ("dask", 2, "ray://127.0.0.1:10001", "'ray://127.0.0.1:10001' is not the address of a Dask cluster"),
        *(("dask", 2, one, "is not the address of a Dask cluster") for one in NO_ADDRESSES),
        ("ray", 2, "", "'' is not the address of a Ray cluster; allowed: such as 127.0.0.1:6379 or ray://"),
        ("ray", 2, "tcp://127.0.0.1:6379", "'tcp://127.0.0.1:6379' is not the address of a Ray cluster"),
    ],
)
def test_runners_that_cannot_be_had_are_refused(runner: str, workers: int, address: str | None, message: str):
    with pytest.raises(InputError) as caught:
        task_runner(runner, workers, address)
    assert message in str(caught.value)


@pytest.mark.parametrize("name", ["dask", "ray"])
def test_a_runner_whose_package_is_not_installed_names_its_extra(monkeypatch: pytest.MonkeyPatch, name: str):
    monkeypatch.setitem(sys.modules, f"prefect_{name}", None)
    with pytest.raises(InputError, match=f"needs the package prefect-{name}.*pip install 'robojoule.{name}.'"):
        task_runner(name)


@pytest.mark.parametrize(
    ("name", "before"),
    [("dask", "tcp://127.0.0.1"), ("dask", "[::1]"), ("ray", "localhost"), ("ray", "ray://127.0.0.1")],
)
def test_an_address_where_nobody_listens_is_one_sentence(name: str, before: str):
    address = f"{before}:{free_port()}"
    with pytest.raises(RobojouleError, match=f"^no {name.title()} cluster answers at {re.escape(address)}$"):
        task_runner(name, address=address)


@pytest.mark.parametrize("name", ["dask", "ray"])
def test_an_address_where_somebody_listens_is_taken(name: str):
    with socket.create_server(("127.0.0.1", 0)) as listening:
        assert task_runner(name, address=f"127.0.0.1:{listening.getsockname()[1]}")
    task_runner("ray", address="auto")
