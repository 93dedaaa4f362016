// A client of `alloc serve` in node, without packages: over HTTP where an address is given, else over lines.
//
//     node examples/clients/client.mjs [http://127.0.0.1:8080]
//
// Sends one instance, prints who does what, and cancels a second request over lines.

import { spawn } from "node:child_process";
import { createInterface } from "node:readline";

const instance = {
  agents: [
    { id: "ann", ability: 4, position: [0, 0] },
    { id: "ben", ability: 3, position: [1, 0] },
    { id: "cleo", ability: 2, position: [4, 3] },
  ],
  tasks: [
    { id: "harbour", workload: 12, position: [0, 0] },
    { id: "station", workload: 6, position: [4, 3] },
  ],
};
const fleet = { // too large to be done at once
  agents: Array.from({ length: 80 }, (_, i) => ({ id: `agent ${i}`, ability: 1 + ((7 * i) % 10), position: [(13 * i) % 17, (5 * i) % 11] })),
  tasks: Array.from({ length: 15 }, (_, j) => ({ id: `task ${j}`, workload: 10 + ((9 * j) % 40), position: [(3 * j) % 17, (7 * j) % 11] })),
};
const request = { id: "first", instance, method: "local-search", objective: "makespan-energy", limit_ms: 200 };

const show = ({ id, result, error }) =>
  console.log(id, error ? `${error.kind}: ${error.message}` : `${result.makespan} h ${JSON.stringify(result.assignment)}`);

async function overHttp(address) {
  const answer = await fetch(`${address}/solve`, { method: "POST", body: JSON.stringify(request) });
  show(await answer.json());
}

async function overLines() {
  const command = process.env.ALLOC ? process.env.ALLOC.split(" ") : ["alloc"];
  const server = spawn(command[0], [...command.slice(1), "serve", "--stdio", "--parallel", "2", "--load", "local-search"], {
    stdio: ["pipe", "pipe", "inherit"],
  });
  const send = (line) => server.stdin.write(`${JSON.stringify(line)}\n`);
  send(request);
  send({ ...request, id: "second", instance: fleet, limit_ms: 10000 });
  for await (const line of createInterface({ input: server.stdout })) {
    const answer = JSON.parse(line);
    show(answer);
    if (answer.id === "first") {
      send({ cancel: "second" });
      server.stdin.end();
    }
  }
}

const address = process.argv[2];
await (address ? overHttp(address) : overLines());
