"""HTTP server: uvicorn with a clean shutdown on signals."""

import logging
import math
import os
import socket
import sys
import time
from collections.abc import Callable
from types import FrameType

import uvicorn

from alloc.allocators.serving.http import build_app
from alloc.allocators.serving.service import Service
from alloc.problems import InputError

SWITCH_S = 0.001
"""Interval in seconds for switching threads, short so that computing threads do not delay the event loop."""

GRACE_S = 5
"""Seconds for open requests to be answered after a signal."""

SAME_SIGNAL_S = 0.5
"""Seconds within which signals count as one, as some programs signal a process and then its group."""


class Server(uvicorn.Server):
    """Server that ends its runs on a signal, so that open requests are answered soon, and exits on a second one."""

    def __init__(self, config: uvicorn.Config, service: Service, tell: Callable[[str], object]) -> None:
        super().__init__(config)
        self._service, self._tell, self._signalled = service, tell, math.inf

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, and report the address."""
        await super().startup(sockets)
        for server in self.servers:
            for listening in server.sockets:
                host, port = listening.getsockname()[:2]
                self._tell(f"http://{f'[{host}]' if ':' in host else host}:{port}")

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End runs on the first signal, exit on the next; unlike uvicorn, do not re-raise the signal after shutdown."""
        now = time.monotonic()
        self._signalled = min(self._signalled, now)
        self._service.end()
        self.force_exit = now > self._signalled + SAME_SIGNAL_S
        self.should_exit = True


class _Reason(logging.Filter):
    """Filter that captures why uvicorn could not listen, which it logs before it exits, for the error message."""

    def __init__(self) -> None:
        super().__init__()
        self.text = "the server did not start"

    def filter(self, record: logging.LogRecord) -> bool:
        """Capture an error of the operating system instead of logging it."""
        error = record.msg
        if not isinstance(error, OSError):
            return True
        if error.errno is not None and error.errno > 0:  # unknown hosts have negative numbers
            self.text = os.strerror(error.errno)
        else:
            self.text = error.strerror or str(error)
        return False


def run_server(service: Service, host: str, port: int, most_bytes: int, tell: Callable[[str], object]) -> None:
    """Serve until a signal arrives.

    Parameters
    ----------
    service : Service
    host : str
    port : int
        Port to listen on; 0 for any free port.
    most_bytes : int
        Maximum size of the body of a request.
    tell : callable
        Called with the address once the service listens.

    Raises
    ------
    InputError
        If it cannot listen there.
    """
    config = uvicorn.Config(
        build_app(service, most_bytes=most_bytes),
        host=host,
        port=port,
        log_level="warning",
        access_log=False,
        timeout_graceful_shutdown=GRACE_S,
        server_header=False,
    )
    server = Server(config, service, tell)
    log, reason, interval_s = logging.getLogger("uvicorn.error"), _Reason(), sys.getswitchinterval()
    log.addFilter(reason)
    sys.setswitchinterval(SWITCH_S)
    try:
        server.run()
    except SystemExit as error:
        words = f"{reason.text[:1].lower()}{reason.text[1:]}"
        raise InputError(f"cannot listen on {host}:{port}: {words}; name another host or port", "http") from error
    finally:
        sys.setswitchinterval(interval_s)
        log.removeFilter(reason)
