"""What is proven while a method runs, at little cost, so that the run ends with the plan that is proven best."""
