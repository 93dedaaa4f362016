"""The process that serves over HTTP: uvicorn, which a signal ends cleanly."""

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
"""Seconds after which a thread that computes in Python lets others go on: the event loop must not wait for it."""

GRACE_S = 5
"""Seconds that open requests have for their answers once a signal has come."""

SAME_SIGNAL_S = 0.5
"""Seconds within which signals are one: some programs send it to a process, and then to its group."""


class Server(uvicorn.Server):
    """Ends its runs on a signal, so that open requests are answered soon; a later one ends it at once."""

    def __init__(self, config: uvicorn.Config, service: Service, tell: Callable[[str], object]) -> None:
        super().__init__(config)
        self._service, self._tell, self._signalled = service, tell, math.inf

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, and tell where."""
        await super().startup(sockets)
        for server in self.servers:
            for listening in server.sockets:
                host, port = listening.getsockname()[:2]
                self._tell(f"http://{f'[{host}]' if ':' in host else host}:{port}")

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Do not raise the signal again at the end, as uvicorn would: this end is a clean one."""
        now = time.monotonic()
        self._signalled = min(self._signalled, now)
        self._service.end()
        self.force_exit = now > self._signalled + SAME_SIGNAL_S
        self.should_exit = True


class _Reason(logging.Filter):
    """Keeps why uvicorn could not listen, which it logs before it exits, for the one line that is said of it."""

    def __init__(self) -> None:
        super().__init__()
        self.text = "it does not start"

    def filter(self, record: logging.LogRecord) -> bool:
        """Take an error of the operating system out of the log."""
        error = record.msg
        if not isinstance(error, OSError):
            return True
        if error.errno is not None and error.errno > 0:  # a host that is not found has numbers below 0
            self.text = os.strerror(error.errno)
        else:
            self.text = error.strerror or str(error)
        return False


def run_server(service: Service, host: str, port: int, most_bytes: int, tell: Callable[[str], object]) -> None:
    """Serve until a signal comes.

    Parameters
    ----------
    service : Service
    host : str
    port : int
        0 for a free one.
    most_bytes : int
        Largest body of a request.
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
