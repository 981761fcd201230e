"""How late a page is: something is sent to it now and then, and its answer timed.

The page takes messages in before each picture it draws, so the answer comes when it would have
shown a pose that was sent at the same time.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import viser

EVERY_S = 2.0
PATIENCE_S = 5.0


class PageProbe:
    """A thread that asks every open page in turn.

    Args:
        server: The pages' server.
        tell: Is told the slowest page's time [ms] after each round; None where none answered.
    """

    def __init__(self, server: viser.ViserServer, tell: Callable[[float | None], None]) -> None:
        self._server = server
        self._tell = tell
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="page probe", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End; a page that is being asked is not waited for."""
        self._ended.set()

    def _run(self) -> None:
        while not self._ended.wait(EVERY_S):
            times = [self._asked_ms(client) for client in self._server.get_clients().values()]
            answers = [ms for ms in times if ms is not None]
            self._tell(max(answers) if answers else None)

    def _asked_ms(self, client: viser.ClientHandle) -> float | None:
        """How long a page takes to answer [ms]; None where it does not."""
        begun = time.monotonic()
        try:
            client.local_storage.get_item("handstudio", timeout=PATIENCE_S)
        except TimeoutError:
            return PATIENCE_S * 1e3
        except RuntimeError:  # it was closed, or keeps nothing, which it says as late as an answer
            pass
        if client.client_id not in self._server.get_clients():
            return None
        return (time.monotonic() - begun) * 1e3
