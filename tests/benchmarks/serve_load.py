"""`alloc serve --http` under load: 20 clients with deadlines of 50 ms, 5 % of whose requests are bad or given up.

    python tests/benchmarks/serve_load.py --seconds 60

Prints the times to answer, the excess over 50 ms + 15 ms for each request ahead, the processor time of an answer, and
the memory of the server. Bad requests are malformed, too large, or given up after 10 ms. On a busy machine look at the
processor time: below 15 ms, a server with a processor of its own keeps to what is promised.
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

import httpx
import numpy as np

from alloc.problems.formats import to_document
from alloc.problems.generate import paper

DEADLINE_MS, PER_REQUEST_MS, BAD_SHARE = 50.0, 15.0, 0.05
METHODS = ("gappo", "local-search", "greedy")


def body(rng: random.Random, instances: list[dict[str, object]], objective: str) -> str:
    request = {"instance": rng.choice(instances), "method": rng.choice(METHODS), "limit_ms": DEADLINE_MS}
    return json.dumps({**request, "objective": objective, "seed": rng.randrange(1000)})


async def client(number: int, address: str, bodies: list[str], until: float, counts: Counter, times: list) -> None:
    rng = random.Random(number)
    async with httpx.AsyncClient(base_url=address, timeout=30) as session:
        while time.monotonic() < until:
            content, kind = rng.choice(bodies), "good"
            if rng.random() < BAD_SHARE:
                kind = rng.choice(["malformed", "oversized", "given up"])
                content = {"malformed": content[:-9], "oversized": content + " " * 5_000_000}.get(kind, content)
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
    with open(f"/proc/{process}/stat") as file:
        return sum(map(int, file.read().rpartition(")")[2].split()[11:13])) / os.sysconf("SC_CLK_TCK")


def memory_mb(process: int) -> float:
    with open(f"/proc/{process}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


async def load(address: str, process: int, options: argparse.Namespace) -> None:
    instances = [to_document(paper(1, seed=seed)) for seed in range(10)]
    bodies = [body(random.Random(number), instances, options.objective) for number in range(50)]
    counts, times, until = Counter(), [], time.monotonic() + options.seconds
    spent_s = processor_s(process)
    clients = [client(number, address, bodies, until, counts, times) for number in range(options.clients)]
    waiting, memory = asyncio.gather(*clients), [memory_mb(process)]
    while not waiting.done():
        await asyncio.wait([waiting], timeout=options.seconds / 10)
        memory.append(memory_mb(process))
    spent_s = processor_s(process) - spent_s
    late = np.array([taken for taken, _ in times])
    excess = np.array([taken - DEADLINE_MS - PER_REQUEST_MS * ahead for taken, ahead in times])
    ahead = np.array([count for _, count in times])
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors; requests:", dict(counts))
    print(
        f"{len(late) / options.seconds:.0f} answers a second, processor time {1000 * spent_s / len(late):.1f} ms each"
    )
    print("ms to answer: p50, p90, p99, worst:", *np.percentile(late, [50, 90, 99, 100]).round(1))
    print(f"ahead: mean {ahead.mean():.1f}, most {ahead.max()}; promised are {50 + 15 * ahead.mean():.0f} ms")
    print(f"beyond 50 ms + 15 ms for each ahead: {(excess > 0).mean():.2%}, p99 by {np.percentile(excess, 99):.0f} ms")
    print("memory of the server, MB:", *(f"{one:.0f}" for one in memory))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--clients", type=int, default=20)
    parser.add_argument("--objective", default="makespan-energy")
    command = [sys.executable, "-m", "alloc", "serve", "--http", "0", "--load", ",".join(METHODS)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        address = server.stderr.readline().split()[-1]
        threading.Thread(target=sys.stderr.writelines, args=(server.stderr,)).start()
        asyncio.run(load(address, server.pid, parser.parse_args()))
        server.terminate()
        print("exit code of the server:", server.wait(30))
