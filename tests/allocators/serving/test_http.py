"""The service over HTTP, in this process: statuses, limits, metrics, disconnects, and a short load test."""

import concurrent.futures
import json
import socket
import threading
import time
from collections import Counter

import httpx
import pytest
import uvicorn

from alloc.allocators.serving.http import build_app
from alloc.allocators.serving.request import ServiceLimits
from alloc.allocators.serving.server import Server
from alloc.allocators.serving.service import Service
from alloc.problems import paper_like
from alloc.problems.formats import to_document

EASY = {"agents": [{"id": "a", "ability": 2}], "tasks": [{"id": "t", "workload": 4}]}
LONG = {
    "instance": to_document(paper_like(60, 25, 400, seed=1)),
    "method": "local-search",
    "objective": "makespan-energy",
}


@pytest.fixture(scope="module")
def service():
    """A service of one run at a time; `address` is where it listens."""
    found = Service(ServiceLimits(agents=100, queue=8, limit_ms=20_000, strangers=True))
    config = uvicorn.Config(build_app(found, most_bytes=20_000), port=0, log_level="warning")
    told, begun = [], threading.Event()
    server = Server(config, found, lambda address: (told.append(address), begun.set()))
    thread = threading.Thread(target=server.run)
    thread.start()
    assert begun.wait(30)
    found.address = told[0]
    yield found
    server.handle_exit(15, None)
    thread.join(30)
    assert not thread.is_alive()


@pytest.fixture
def client(service):
    with httpx.Client(base_url=service.address, timeout=30) as found:
        yield found


def test_status_codes(client):
    """Solved requests give 200, bad input 400, refusals 422, and bodies that are too large 413."""
    solved = client.post("/solve", json={"id": 1, "instance": EASY})
    assert (solved.status_code, solved.json()["id"], solved.json()["result"]["makespan"]) == (200, 1, 2.0)
    assert client.post("/solve", content=b"{").status_code == 400
    binary = client.post("/solve", content=b"\xff")
    assert (binary.status_code, binary.json()["error"]["message"]) == (400, "body: is not UTF-8 text")
    assert client.post("/solve", json={"instance": {**EASY, "agents": [{}] * 101}}).status_code == 400
    endless = client.post("/solve", content=b'{"id": NaN, "instance": {}}')
    assert (endless.status_code, endless.json()["id"]) == (400, None)
    fast = {"agents": [{"id": "a", "ability": 2, "speed": 1}], "tasks": EASY["tasks"]}
    assert client.post("/solve", json={"instance": fast, "method": "ga"}).status_code == 422
    large = client.post("/solve", content=b" " * 20_001)
    assert (large.status_code, large.headers["connection"]) == (413, "close")
    assert "at most 20000 bytes" in large.json()["error"]["message"]
    assert client.post("/nothing").status_code == 404


def test_health_metrics_and_openapi(client):
    """Health tells what is open, metrics count requests by outcome, OpenAPI describes the body."""
    client.post("/solve", json={"instance": EASY})
    assert client.get("/health").json() == {"status": "ok", "open_requests": 0}
    text = client.get("/metrics").text
    assert 'alloc_requests_total{outcome="solved"}' in text
    assert "alloc_request_seconds_bucket" in text
    body = client.get("/openapi.json").json()["paths"]["/solve"]["post"]["requestBody"]
    assert "limit_ms" in body["content"]["application/json"]["schema"]["properties"]


def test_disconnect_cancels_the_run(service, client):
    """Once the connection is closed, the run ends long before its limit."""
    body = json.dumps(LONG).encode()
    host, port = service.address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port))) as raw:
        raw.sendall(b"POST /solve HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
        until(lambda: service.open_requests == 1)
    until(lambda: service.open_requests == 0)


def test_incomplete_body_is_discarded(service, client, caplog):
    """An incomplete body is discarded, without a traceback in the log."""
    host, port = service.address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port))) as raw:
        raw.sendall(b"POST /solve HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n{")
    assert client.post("/solve", json={"instance": EASY}).status_code == 200
    assert 'alloc_requests_total{outcome="cancelled"}' in client.get("/metrics").text
    assert caplog.records == []


def test_load_is_answered_in_time(service, client):
    """Eight clients with deadlines of 50 ms, some of whose requests are bad, all have answers; the queue empties."""
    before = threading.active_count()
    good = {**LONG, "limit_ms": 50}

    def ask(number: int) -> int:
        body = b"{" if number % 10 == 9 else json.dumps(good).encode()
        return client.post("/solve", content=body).status_code

    begin = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        found = Counter(pool.map(ask, range(40)))
    assert found == {200: 36, 400: 4}
    assert time.monotonic() - begin < 20
    assert service.open_requests == 0
    assert threading.active_count() <= before + 2


def test_full_queue_gives_503(service, client):
    """Requests beyond the running and waiting ones are rejected, with the advice to try again."""
    jobs = [service.submit(LONG) for _ in range(9)]
    busy = client.post("/solve", json={"instance": EASY})
    assert (busy.status_code, busy.headers["retry-after"], busy.json()["error"]["kind"]) == (503, "1", "busy")
    for job in jobs:
        job.cancel()
    until(lambda: service.open_requests == 0)


def until(is_so):
    """Wait until a condition holds, at most 10 s."""
    limit = time.monotonic() + 10
    while not is_so():
        assert time.monotonic() < limit
        time.sleep(0.01)
