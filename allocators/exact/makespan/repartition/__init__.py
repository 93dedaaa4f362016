"""Search by repartition: the agents of a few tasks are reassigned optimally."""
