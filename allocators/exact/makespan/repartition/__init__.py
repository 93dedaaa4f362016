"""Plans by repartition: the agents of a few tasks assigned anew."""
