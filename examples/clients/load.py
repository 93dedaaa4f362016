"""Load test of `alloc serve --http`: many clients with deadlines, some of whose requests are invalid or aborted.

    python examples/clients/load.py --seconds 60

Starts a server, and prints the response times, their excess over 50 ms + 15 ms for each request ahead, the processor
time per answer, and the memory of the server. 5 % of the requests are malformed, too large, or aborted after 10 ms.
On a busy machine, rely on the processor time: below 15 ms, a server with its own processor meets these response
times. Requires `pip install 'alloc-mrta[serve]' httpx`, and Linux.
"""

import argparse
import asyncio
import json
import os
import random
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import httpx
import numpy as np

from alloc.problems.formats import to_document
from alloc.problems.generate import paper

SERVED = ("gappo", "local-search", "greedy")
DEADLINE_MS, PER_REQUEST_MS, BAD_SHARE, OVERSIZED = 50.0, 15.0, 0.05, 5_000_000


def service(given: argparse.Namespace) -> None:
    """Start a server, and send it the requests of many clients."""
    command = [sys.executable, "-m", "alloc", "serve", "--http", "0", "--load", ",".join(SERVED)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        address = server.stderr.readline().split()[-1]
        threading.Thread(target=sys.stderr.writelines, args=(server.stderr,)).start()
        asyncio.run(ask(address, server.pid, given))
        server.terminate()
        print("exit code of the server:", server.wait(30))


async def ask(address: str, process: int, given: argparse.Namespace) -> None:
    """Run all clients, and print statistics of the answers."""
    rng = random.Random(0)
    instances = [to_document(paper(1, seed=seed)) for seed in range(10)]
    common = {"limit_ms": DEADLINE_MS, "objective": given.objective}
    bodies = [
        json.dumps({"instance": rng.choice(instances), "method": rng.choice(SERVED), "seed": number, **common})
        for number in range(50)
    ]
    counts, times = Counter[str](), list[tuple[float, int]]()
    until, spent_s, memory = time.monotonic() + given.seconds, processor_s(process), [memory_mb(process)]
    waiting = asyncio.gather(*(client(one, address, bodies, until, counts, times) for one in range(given.clients)))
    while not waiting.done():
        await asyncio.wait([waiting], timeout=given.seconds / 10)
        memory.append(memory_mb(process))
    spent_ms = 1000 * (processor_s(process) - spent_s) / len(times)
    taken, ahead = np.array(times).T
    excess = taken - DEADLINE_MS - PER_REQUEST_MS * ahead
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors; requests:", dict(counts))
    print(f"{len(times) / given.seconds:.0f} answers per second, processor time {spent_ms:.1f} ms each")
    print("ms to answer, p50, p90, p99, worst:", *np.percentile(taken, [50, 90, 99, 100]).round(1))
    print(f"ahead: mean {ahead.mean():.1f}, max {ahead.max():.0f}; target {50 + 15 * ahead.mean():.0f} ms")
    print(f"beyond 50 ms + 15 ms for each ahead: {(excess > 0).mean():.2%}, p99 by {np.percentile(excess, 99):.0f} ms")
    print("memory of the server, MB:", *(f"{one:.0f}" for one in memory))


async def client(
    number: int, address: str, bodies: Sequence[str], until: float, counts: Counter[str], times: list[tuple[float, int]]
) -> None:
    """Send requests until the time is over; count all answers, and record time and requests ahead of the good ones."""
    rng = random.Random(number)
    async with httpx.AsyncClient(base_url=address, timeout=30) as session:
        while time.monotonic() < until:
            content, kind = rng.choice(bodies), "good"
            if rng.random() < BAD_SHARE:
                kind = rng.choice(["malformed", "oversized", "given up"])
                content = {"malformed": content[:-9], "oversized": content + " " * OVERSIZED}.get(kind, content)
            begin = time.monotonic()
            try:
                answer = await session.post("/solve", content=content, timeout=0.01 if kind == "given up" else 30)
            except httpx.TransportError as error:
                counts[f"{kind}: {type(error).__name__}"] += 1
                continue
            counts[f"{kind}: {answer.status_code}"] += 1
            if kind == "good" and answer.status_code == 200:
                times.append((1000 * (time.monotonic() - begin), answer.json()["ahead"]))


def processor_s(process: int) -> float:
    """Return the processor time of a process in seconds."""
    user, system = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def memory_mb(process: int) -> float:
    """Return the resident memory of a process in MB."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--clients", type=int, default=20)
    parser.add_argument("--objective", default="makespan-energy")
    service(parser.parse_args())


if __name__ == "__main__":
    main()
