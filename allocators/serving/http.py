"""HTTP service with FastAPI: OpenAPI, health, metrics, and limits on requests."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from http import HTTPStatus
from importlib.metadata import version

from fastapi import FastAPI, Request, Response
from fastapi.responses import JSONResponse
from starlette.requests import ClientDisconnect

from alloc.allocators.serving.metrics import Metrics
from alloc.allocators.serving.service import Answer, Outcome, Service, failure
from alloc.problems.formats.schemas import schema

STATUS = {
    Outcome.SOLVED: HTTPStatus.OK,
    Outcome.INPUT: HTTPStatus.BAD_REQUEST,
    Outcome.REFUSED: HTTPStatus.UNPROCESSABLE_ENTITY,
    Outcome.BUSY: HTTPStatus.SERVICE_UNAVAILABLE,
    Outcome.CANCELLED: HTTPStatus.REQUEST_TIMEOUT,
    Outcome.FAILED: HTTPStatus.INTERNAL_SERVER_ERROR,
}

BODY_S = 10.0
"""Time limit for the body of a request to arrive, in seconds."""


def build_app(service: Service, *, most_bytes: int = 4_000_000) -> FastAPI:
    """Return the FastAPI application of a service.

    Parameters
    ----------
    service : Service
        The service, which is closed when the application ends.
    most_bytes : int
        Maximum size of the body of a request.
    """
    metrics = Metrics(service)

    @contextlib.asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        service.end()
        await asyncio.to_thread(service.close)

    app = FastAPI(title="alloc", version=version("alloc-mrta"), lifespan=lifespan)

    @app.post("/solve", responses=_responses(), openapi_extra=_body())
    async def solve(request: Request) -> Response:
        """Allocate the agents of an instance to its tasks."""
        with metrics.timed() as timed:
            body = await _body_of(request, most_bytes)
            if body is None:
                timed.outcome = Outcome.CANCELLED
                return Response()  # the client has disconnected
            if isinstance(body, HTTPStatus):
                timed.outcome = Outcome.INPUT
                limits = f"{body.phrase}; at most {most_bytes} bytes within {BODY_S:g} s"
                words = "is not UTF-8 text" if body is HTTPStatus.BAD_REQUEST else limits
                return _response(failure("", Outcome.INPUT, f"body: {words}"), body)
            answer = await _answer(service, request, body)
            response = _response(answer, STATUS[answer.outcome])
            timed.outcome = answer.outcome
            return response

    @app.get("/health")
    async def health() -> JSONResponse:
        """Return whether requests are accepted, and how many are open."""
        content = {"status": "ending" if service.is_ending else "ok", "open_requests": service.open_requests}
        return JSONResponse(content, HTTPStatus.SERVICE_UNAVAILABLE if service.is_ending else HTTPStatus.OK)

    @app.get("/metrics")
    async def read_metrics() -> Response:
        """Return counters and latencies for Prometheus."""
        return Response(metrics.text(), media_type=metrics.media_type)

    return app


async def _body_of(request: Request, most_bytes: int) -> str | HTTPStatus | None:
    """Return the body as text, a status if it is too large, too slow or not UTF-8, or None if the client is gone."""
    found = bytearray()
    try:
        async with asyncio.timeout(BODY_S):
            async for chunk in request.stream():
                found += chunk
                if len(found) > most_bytes:
                    return HTTPStatus.REQUEST_ENTITY_TOO_LARGE
        return found.decode()
    except ClientDisconnect:
        return None
    except TimeoutError:
        return HTTPStatus.REQUEST_TIMEOUT
    except UnicodeDecodeError:
        return HTTPStatus.BAD_REQUEST


async def _answer(service: Service, request: Request, body: str) -> Answer:
    """Return the answer; the run is cancelled if the client disconnects."""
    job = service.submit(body)
    answer = asyncio.wrap_future(job.answer)
    left = asyncio.ensure_future(_left(request))
    try:
        either: list[asyncio.Future[Answer] | asyncio.Future[None]] = [answer, left]
        await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
        if not answer.done():
            job.cancel()
        return await answer
    except asyncio.CancelledError:
        job.cancel()
        raise
    finally:
        left.cancel()


async def _left(request: Request) -> None:
    """Return once the client has closed the connection."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


def _response(answer: Answer, status: HTTPStatus) -> Response:
    headers = {"Retry-After": "1"} if status is HTTPStatus.SERVICE_UNAVAILABLE else {}
    if status in (HTTPStatus.REQUEST_ENTITY_TOO_LARGE, HTTPStatus.REQUEST_TIMEOUT):
        headers["Connection"] = "close"
    return Response(answer.text, status, headers, "application/json")


def _body() -> dict[str, object]:
    content = {"application/json": {"schema": _schema("alloc-solve-request/1")}}
    return {"requestBody": {"required": True, "content": content}}


def _responses() -> dict[int | str, dict[str, object]]:
    content = {"application/json": {"schema": _schema("alloc-solve-answer/1")}}
    words = {
        HTTPStatus.OK: "The result.",
        HTTPStatus.BAD_REQUEST: "The request is invalid or exceeds a limit.",
        HTTPStatus.REQUEST_TIMEOUT: "The body took too long to arrive.",
        HTTPStatus.REQUEST_ENTITY_TOO_LARGE: "The body is too large.",
        HTTPStatus.UNPROCESSABLE_ENTITY: "The method refuses the instance.",
        HTTPStatus.SERVICE_UNAVAILABLE: "Too many requests are open, or the service is shutting down.",
    }
    return {status.value: {"description": text, "content": content} for status, text in words.items()}


def _schema(name: str) -> dict[str, object]:
    """Return the schema of a format in the form that OpenAPI embeds."""
    return {key: value for key, value in schema(name).items() if not key.startswith("$")}
