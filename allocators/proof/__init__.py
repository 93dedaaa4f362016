"""Cheap proofs during a run, so that it ends as soon as its plan is proven to be optimal."""
