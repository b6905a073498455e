"""A watchdog for whoever has to send actions in time."""

import threading
from collections.abc import Callable


class Watchdog:
    """Calls a function, on its own thread, whenever nothing has fed it for a while: once each time.

    It starts to watch when it is fed first. It cannot call while the process computes without giving way to
    Python's other threads, so what it watches over must be safe then, too.
    """

    def __init__(self, patience: float, starved: Callable[[], None]) -> None:
        """Wait ``patience`` seconds for food before calling ``starved``."""
        self._patience = patience
        self._starved = starved
        self._fed = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self._thread.start()

    def feed(self) -> None:
        """Say that all is well."""
        self._fed.set()

    def end(self) -> None:
        """Stop watching, and wait for a call that is under way."""
        self._ended = True
        self._fed.set()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _watch(self) -> None:
        while True:
            self._fed.wait()  # for the first sign of life, or the next after a silence
            while self._fed.wait(self._patience):
                if self._ended:
                    return
                self._fed.clear()
            self._starved()
