"""State dictionaries of networks, optimisers and learners."""

from typing import Any

StateDict = dict[str, Any]
"""State of a learner by name: tensors, numbers, strings, and lists and dictionaries of these, as torch's own."""
