"""The description of a training run by which a checkpoint is recognised."""

import hashlib
from dataclasses import asdict, fields, replace

from alloc.allocators.learned.training.parameters import TrainingParameters
from alloc.allocators.learned.training.validation import VALIDATION
from alloc.problems import Instance
from alloc.problems.game import FEATURE_SET


def described(parameters: TrainingParameters, seed: int) -> dict[str, str]:
    """Return all that decides the learning curve, flat and as text."""
    instances = parameters.curriculum.instances
    plain = replace(parameters, curriculum=replace(parameters.curriculum, instances=()))
    text = {"seed": str(seed), "features": FEATURE_SET, "validation": VALIDATION, **_flat("", asdict(plain))}
    text["instances"] = ", ".join(_digest(one.instance) for one in instances) or "none"
    return text


def _flat(prefix: str, values: dict[str, object]) -> dict[str, str]:
    flat = {}
    for name, value in values.items():
        if isinstance(value, dict):
            flat.update(_flat(f"{prefix}{name}.", value))
        else:
            flat[prefix + name] = ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
    return flat


def _digest(instance: Instance) -> str:
    """Return the name of an instance and a hash of its content."""
    digest = hashlib.sha256()
    for column in fields(instance):
        value = getattr(instance, column.name)
        digest.update(value.tobytes() if hasattr(value, "tobytes") else repr(value).encode())
    return f"{instance.name} ({digest.hexdigest()[:8]})"
