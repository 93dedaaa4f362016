"""A place for runs in the process of the test: for tests of what is planned, kept and told, at no cost of processes."""

import json
import pickle

from alloc.allocators.experiments.isolation.places import Here
from alloc.allocators.experiments.isolation.serve import failure, maker
from alloc.allocators.experiments.store.outcome import Outcome


class InProcess(Here):
    def handle(self, cores, threads, *, is_timed):
        return _Direct()


class _Direct:
    is_alive, is_reusable, handles = True, True, ()

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
        pass
