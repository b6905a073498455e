"""Jobs on a Ray cluster whose machines share the folder of results (and have er_il installed)."""

import socket
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from er_il.support.errors import ErIlError
from er_il.support.workers import ONE_THREAD

PATIENCE = 10.0  # [s] for the cluster to answer
RETRIES = 3  # of a job whose process or machine died under it


class RayExecutor:
    """Runs functions on a Ray cluster in a ``with`` statement, each on one core; again if their machine died.

    Raises:
        ErIlError: Ray is not installed, or there is no cluster at the address.
    """

    def __init__(self, address: str) -> None:
        try:
            import ray
        except ImportError as error:
            raise ErIlError("Ray is not installed. It is an extra: pip install 'lerobot_env_er_il[ray]'.") from error
        self._ray, self._address = ray, address

    def __enter__(self) -> "RayExecutor":
        host, _, port = self._address.rpartition(":")
        try:
            if host and port.isdigit():  # Ray itself would try for minutes
                socket.create_connection((host.removeprefix("ray://"), int(port)), timeout=PATIENCE).close()
            self._ray.init(self._address, runtime_env={"env_vars": ONE_THREAD}, log_to_driver=False)
        except (OSError, OverflowError, ValueError) as error:
            raise ErIlError(f"No Ray cluster at {self._address}: {error}") from error
        return self

    def __exit__(self, *exception: object) -> None:
        self._ray.shutdown()

    @property
    def workers(self) -> int:
        """Number of cores that the cluster has at the moment; machines may join and leave."""
        return max(1, int(self._ray.cluster_resources().get("CPU", 1)))

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> "Future[Any]":
        """Run a function somewhere on the cluster."""
        return self._ray.remote(num_cpus=1, max_retries=RETRIES)(function).remote(*arguments).future()
