"""The service: requests by limits, deadlines, queue and cancellation; and over lines of JSON."""

import json
import threading
import time

import pytest
from schema_checks import faults

from alloc.allocators import Allocator, load, solve
from alloc.allocators.serving.lines import RequestLines
from alloc.allocators.serving.request import ServiceLimits
from alloc.allocators.serving.service import Answer, Outcome, Service
from alloc.problems import InputError, Instance, paper_like
from alloc.problems.formats import to_document

EASY = {"agents": [{"id": "a", "ability": 2}], "tasks": [{"id": "t", "workload": 4}]}
FLYING = {"agents": [{"id": "a", "ability": 2, "speed": 1}], "tasks": EASY["tasks"]}
HARD = to_document(paper_like(60, 25, 400, seed=1))
LONG = {"instance": HARD, "method": "local-search", "objective": "makespan-energy"}


@pytest.fixture
def service():
    """A service for untrusted clients, with one run at a time and one waiting request."""
    found = Service(ServiceLimits(agents=100, tasks=50, queue=1, limit_ms=60_000, strangers=True))
    yield found
    found.end()
    found.close()


def answered(service: Service, request: object) -> Answer:
    """Return the answer to one request, valid by the schemas of both."""
    if isinstance(request, dict):
        assert faults({"format": "alloc-solve-request/1", **request}) == []
    answer = service.submit(request if isinstance(request, str) else json.dumps(request)).answer.result(30)
    assert faults(json.loads(answer.text)) == []
    return answer


def test_answer_matches_solve(service):
    """A request gives what `solve` gives, with its id; the method is loaded once."""
    request = {"id": 3, "instance": HARD, "method": "ga", "parameters": {"population": 8}, "iterations": 3, "seed": 5}
    answer = answered(service, request)
    assert (answer.outcome, answer.document["id"]) == (Outcome.SOLVED, 3)
    expected = solve(paper_like(60, 25, 400, seed=1), "ga", population=8, iterations=3, seed=5, threads=1)
    assert answer.document["result"]["assignment"] == expected.to_dict()["assignment"]
    assert answer.document["result"]["parameters"] == {"population": 8}
    loaded = next(iter(service._others.values()))
    answered(service, request)
    assert list(service._others.values()) == [loaded]


@pytest.mark.parametrize(
    ("request_", "kind", "words"),
    [
        ("", "input", "is empty"),
        ("{", "input", "line 1 column 2"),
        ("[]", "input", "must be a JSON object"),
        ('{"instance": {}, "instance": {}}', "input", "occurs twice"),
        ({"instance": EASY, "colour": 1}, "input", "unknown field 'colour'"),
        ({"cancel": 1}, "input", "unknown field 'cancel'"),
        ({"instance": {"agents": [{"id": "a"}], "tasks": EASY["tasks"]}}, "input", "instance.agents[0].ability"),
        ({"instance": {**EASY, "agents": [{}] * 101}}, "input", "101 agents; this service accepts at most 100"),
        ({"instance": EASY, "limit_ms": 70_000}, "input", "limit_ms: must be a finite number >= 0 and at most 60000"),
        ({"instance": EASY, "method": "gaa"}, "input", "did you mean 'ga'"),
        ({"instance": EASY, "method": "ga", "parameters": {"pop": 1}}, "input", "known are population,"),
        ({"instance": EASY, "parameters": {"pop": 1}}, "input", "can only be set for a named method"),
        ({"instance": EASY, "method": "gappo", "parameters": {"policy": "/etc/passwd"}}, "input", "cannot be set"),
        ({"instance": EASY, "method": "gappo", "parameters": {"device": "cuda"}}, "input", "cannot be set"),
        ({"instance": EASY, "method": "milp", "parameters": {"plain": True}}, "input", "parameters.plain: cannot be"),
        ({"instance": EASY, "method": "ga", "parameters": {"population": 10**7}}, "input", "at most 10000"),
        ({"instance": EASY, "parameters": []}, "input", "parameters: must be a JSON object, got a list"),
        ({"instance": EASY, "pins": 1}, "input", "pins: must be a JSON object, got 1"),
        ({"instance": EASY, "start": "x"}, "input", "start: must be a JSON object, got 'x'"),
        ({"instance": EASY, "threads": 0}, "input", "threads: must be a whole number from 1"),
        ({"instance": EASY, "id": [1]}, "input", "id: must be a string or a number from -9007199254740991"),
        ({"instance": EASY, "id": True}, "input", "id: must be a string"),
        ({"instance": EASY, "id": 2**53 + 1}, "input", "id: must be a string"),
        ({"instance": EASY, "seed": 2**53 + 1}, "input", "seed: must be a whole number from 0 to 9007199254740991"),
        ('{"id": NaN, "instance": {}}', "input", "id: must be a string"),
        ('{"id": -1e999, "instance": {}}', "input", "id: must be a string"),
        ({"instance": EASY, "start": {"b": "t"}, "method": "ga"}, "input", "start"),
        ({"instance": FLYING, "method": "ga"}, "refused", "speeds"),
    ],
)  # fmt: skip
def test_bad_requests_get_a_one_line_error(service, request_, kind, words):
    """Every error in a request is reported with its place, and the service continues."""
    if isinstance(request_, dict):
        request_ = json.dumps(request_)
    answer = service.submit(request_).answer.result(30)
    assert answer.outcome == kind
    assert words in answer.document["error"]["message"]
    assert json.loads(answer.text)["id"] is None
    assert answered(service, {"instance": EASY}).outcome is Outcome.SOLVED


def test_full_queue_rejects_requests(service):
    """Beyond one running and one waiting request, the answer is busy at once; cancelled requests make room."""
    jobs = [service.submit({**LONG, "id": number}) for number in range(3)]
    assert jobs[2].answer.result(0).outcome is Outcome.BUSY
    assert service.open_requests == 2
    for job in jobs:
        job.cancel()
    assert [job.answer.result(30).outcome for job in jobs] == [Outcome.CANCELLED, Outcome.CANCELLED, Outcome.BUSY]
    assert service.open_requests == 0
    assert answered(service, {"instance": EASY}).outcome is Outcome.SOLVED


def test_deadline_counts_from_arrival(service):
    """A request that waited for its whole time limit gets a first plan, without additional time."""
    first, second = (service.submit({**LONG, "limit_ms": 1000}) for _ in range(2))
    runtimes = [job.answer.result(30).document["result"]["runtime_s"] for job in (first, second)]
    assert runtimes[0] > 0.5
    assert runtimes[1] < 0.3


def test_shutdown_answers_open_requests(service):
    """A service that ends answers open requests with the best so far, and rejects further requests."""
    job = service.submit(LONG)
    time.sleep(0.1)
    service.end()
    assert job.answer.result(30).document["result"]["stop_reason"] == "interrupted"
    assert service.submit(LONG).answer.result(0).outcome is Outcome.BUSY


@pytest.mark.parametrize("kind", [ZeroDivisionError, SystemExit])
def test_unexpected_exceptions_are_answered(service, monkeypatch, caplog, kind):
    """An unexpected exception or exit is answered as failed and logged with its traceback; no request stays open."""

    def fail(*_: object, **__: object) -> None:
        raise kind("by nothing")

    monkeypatch.setattr("alloc.allocators.serving.service.solve", fail)
    answer = answered(service, {"instance": EASY})
    assert (answer.outcome, "by nothing" in answer.document["error"]["message"]) == (Outcome.FAILED, True)
    assert [record.exc_info[0] for record in caplog.records] == [kind]
    assert service.open_requests == 0


def test_loading_a_method_does_not_block_others(monkeypatch):
    """While a method is being loaded, once for two requests, requests for loaded methods are answered."""
    begun, loaded, names = threading.Event(), threading.Event(), []

    def slowly(name: str, parameters: dict) -> Allocator:
        names.append(name)
        if name == "ga":
            begun.set()
            assert loaded.wait(30)
        return load(name, parameters)

    monkeypatch.setattr("alloc.allocators.serving.service.load", slowly)
    service = Service(ServiceLimits(parallel=3))
    try:
        assert answered(service, {"instance": EASY, "method": "greedy"}).outcome is Outcome.SOLVED
        slow = [service.submit({"instance": EASY, "method": "ga", "iterations": 1}) for _ in range(2)]
        assert begun.wait(30)
        assert answered(service, {"instance": EASY, "method": "greedy"}).outcome is Outcome.SOLVED
        assert not any(job.answer.done() for job in slow)
        loaded.set()
        assert [job.answer.result(30).outcome for job in slow] == [Outcome.SOLVED] * 2
        assert names == ["greedy", "ga"]
    finally:
        loaded.set()
        service.close()


def test_preloaded_methods_use_their_parameters():
    """A method loaded with parameters uses them in requests that set none."""
    service = Service(ServiceLimits(), {"ga": {"population": 8}})
    try:
        result = service.submit({"instance": EASY, "method": "ga"}).answer.result(30).document["result"]
        assert result["parameters"] == {"population": 8}
    finally:
        service.close()
    with pytest.raises(InputError):
        Service(ServiceLimits(), {"ga": {"population": 0}})


def test_lines_are_answered_in_order_of_completion():
    """Requests in lines are distinguished by ids: short ones overtake, cancelled ones end, errors get an answer."""
    service, written, grown = Service(ServiceLimits(parallel=2)), [], threading.Event()

    def write(line: str) -> None:
        written.append(json.loads(line))
        grown.set()

    lines = RequestLines(service, write)
    lines.take(json.dumps({**LONG, "id": "long"}))
    lines.take(json.dumps({"id": 1, "instance": EASY}))
    assert grown.wait(30)
    lines.take(json.dumps({**LONG, "id": "long"}))
    lines.take("\n")
    lines.take("nonsense")
    lines.take(json.dumps({"instance": EASY}))
    lines.take('{"cancel": 99}')
    lines.take('{"cancel": "long"}')
    service.close()
    assert [faults(answer) for answer in written] == [[]] * len(written)
    kinds = [(answer["id"], answer.get("error", {}).get("kind", "solved")) for answer in written]
    assert kinds[:2] == [(1, "solved"), ("long", "input")]
    assert sorted(map(str, kinds[2:])) == sorted(
        map(str, [(None, "input"), (None, "input"), (None, "input"), ("long", "cancelled")])
    )


def test_invalid_ids_are_answered_over_lines(service):
    """An id that is not a finite number is an error, answered without an id; large integers are returned exactly."""
    written = []
    lines = RequestLines(service, lambda line: written.append(json.loads(line)))
    lines.take('{"id": NaN, "cancel": 1}')
    lines.take('{"id": 1, "cancel": NaN}')
    lines.take(json.dumps({"instance": EASY}).replace("{", '{"id": 1e999, ', 1))
    assert [(one["id"], one["error"]["kind"]) for one in written] == [(None, "input"), (1, "input"), (None, "input")]
    assert [faults(one) for one in written] == [[]] * 3
    assert answered(service, {"id": 2**53 - 1, "instance": EASY}).document["id"] == 2**53 - 1


def test_assignments_refer_to_the_instance_of_the_request(service):
    """The assignment of an answer is one of the instance of the request."""
    instance = Instance(ability=[2.0, 1.0], workload=[4.0, 1.0])
    answer = answered(service, {"instance": to_document(instance), "method": "greedy"})
    assert set(answer.document["result"]["assignment"]) == set(instance.agent_ids)
