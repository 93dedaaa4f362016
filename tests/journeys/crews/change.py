"""A crew drops out, and an urgent job comes in."""

from alloc.problems import read_instance, write_instance

today = read_instance("today.json")
later = today.without_agents(["east"]).with_tasks(
    [{"id": "flood", "workload": 6, "position": [5, 5], "needs": ["pump"], "priority": 9}]
)
write_instance(later, "later.json")
