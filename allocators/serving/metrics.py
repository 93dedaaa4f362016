"""Request counters and latencies of a service, for Prometheus."""

import asyncio
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Gauge, Histogram, generate_latest

from alloc.allocators.serving.service import Outcome, Service

BUCKETS_S = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


@dataclass
class Timed:
    """A request in progress, and its outcome."""

    outcome: Outcome = Outcome.FAILED


class Metrics:
    """Metrics of one service, with their own registry."""

    media_type = CONTENT_TYPE_LATEST

    def __init__(self, service: Service) -> None:
        self._registry = CollectorRegistry()
        self._requests = Counter("alloc_requests", "Requests by outcome.", ["outcome"], registry=self._registry)
        self._seconds = Histogram(
            "alloc_request_seconds", "Seconds to answer.", buckets=BUCKETS_S, registry=self._registry
        )
        Gauge("alloc_open_requests", "Running and waiting requests.", registry=self._registry).set_function(
            lambda: service.open_requests
        )
        for outcome in Outcome:
            self._requests.labels(outcome)

    @contextmanager
    def timed(self) -> Iterator[Timed]:
        """Count and time the request that is answered within this context."""
        timed, begin = Timed(), time.monotonic()
        try:
            yield timed
        except asyncio.CancelledError:
            timed.outcome = Outcome.CANCELLED
            raise
        finally:
            self._requests.labels(timed.outcome).inc()
            self._seconds.observe(time.monotonic() - begin)

    def text(self) -> bytes:
        """Return all metrics in the format of Prometheus."""
        text: bytes = generate_latest(self._registry)
        return text
