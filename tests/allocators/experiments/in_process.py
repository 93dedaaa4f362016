"""A place that executes runs in the process of the test, for fast tests of planning, storing and reporting."""

import json
import os
import pickle

from alloc.allocators.experiments.isolation.places import ThisMachine
from alloc.allocators.experiments.isolation.serve import failure, maker
from alloc.allocators.experiments.store.outcome import Outcome


class InProcess(ThisMachine):
    def handle(self, cores, threads, *, is_timed):
        return _Direct()


class _Direct:
    is_alive, is_reusable = True, True

    def __init__(self):
        self._ready = open(os.devnull, "rb")  # noqa: SIM115 -- always readable: nobody waits
        self.handles = [self._ready]

    def send(self, order, limits):
        try:
            figures = maker(order)(order.run, pickle.loads(order.instance))
        except Exception as error:
            figures = failure(error)
        self._figures = json.loads(json.dumps(figures))
        self._figures["outcome"] = Outcome(self._figures["outcome"])

    def figures(self):
        return self._figures

    def end(self):
        self._ready.close()
