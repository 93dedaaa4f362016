"""Ablation of GAPPO: the effect of its population, and of each component by a variant without it."""

from collections.abc import Sequence

from alloc.allocators.experiments.reproduction.findings import SIGNIFICANT, table, tested, told
from alloc.allocators.experiments.reproduction.prose import ABLATION
from alloc.allocators.experiments.reproduction.protocol import ABLATIONS, TESTS
from alloc.allocators.experiments.reproduction.rows import Learned
from alloc.allocators.experiments.reproduction.summary import Effect, effect, final, of_scenario
from alloc.allocators.experiments.statistics import holm

GAIN = 0.01
"""p-value, after Holm's correction, below which the population counts as having an effect."""

DECISIVE = 9
"""Fewest runs with which p can be below `GAIN` after Holm's correction over two tests."""

COMPARED = {"makespan": "final T", "drawn": "best of 8 sampled games"}
"""Figures that are compared, in words."""


def population(rows: Sequence[Learned]) -> str:
    """State the effect of the population of GAPPO against a single member and, separately, against PPO."""
    finding = _against_one_member(rows)
    beside = "; ".join(f"{words} {told(one, '+.4f')}" for words, one in _differences(rows, "ppo").items())
    return finding + (f" Against `ppo`, which differs in more than the population: {beside}." if beside else "")


def _differences(rows: Sequence[Learned], other: str) -> dict[str, Effect]:
    """Return by how much `gappo` differs from another method on the test games."""
    own = of_scenario(rows, TESTS)
    pairs = {words: effect(own, "gappo", other, final(figure)) for figure, words in COMPARED.items()}
    return {words: one for words, one in pairs.items() if one is not None}


def _against_one_member(rows: Sequence[Learned]) -> str:
    """Return the finding on the population, from the runs of `gappo` and `gappo-single` alone."""
    known = _differences(rows, "gappo-single")
    if not known:
        return "**The effect of the population was not measured**: `gappo` and `gappo-single` have no run in common."
    corrected = holm([one.p for one in known.values()])
    gains = [
        words
        for (words, one), p in zip(known.items(), corrected, strict=True)
        if one.mean < 0 and p is not None and p < GAIN
    ]
    figures = "; ".join(f"{words} {told(one, '+.4f')}" for words, one in known.items())
    if gains:
        return f"**The population helps** ({', '.join(gains)}; p < {GAIN} after Holm), against one member: {figures}."
    few = max(one.runs for one in known.values()) < DECISIVE
    why = f"fewer than {DECISIVE} runs cannot show one" if few else f"no p < {GAIN} after Holm"
    return f"**No effect of the population is shown** ({why}), against one member: {figures}."


def ablations(rows: Sequence[Learned]) -> str:
    """Return the table of ablations on the test games."""
    own = of_scenario(rows, TESTS)
    effects = {(name, figure): effect(own, name, "gappo", final(figure)) for name in ABLATIONS for figure in COMPARED}
    known = {key: one for key, one in effects.items() if one is not None}
    corrected = dict(zip(known, holm([one.p for one in known.values()]), strict=True))
    lines = []
    for name, (part, meaning) in ABLATIONS.items():
        cells = [tested(effects[name, figure], corrected.get((name, figure)), "+.4f") for figure in COMPARED]
        verdict = _without(effects[name, "makespan"], corrected.get((name, "makespan")), len(known))
        lines.append([part, f"`{name}`", meaning, *cells, f"**{verdict}**"])
    header = ["component", "variant without it", "meaning", *(f"{words}, minus `gappo`" for words in COMPARED.values())]
    return f"{ABLATION}\n\n" + table([*header, "finding on T"], lines, left=6)


def _without(one: Effect | None, p: float | None, tests: int) -> str:
    """Return the verdict on a component from the final makespan without it, with p corrected over `tests` tests."""
    if one is None:
        return "not measured"
    if p is None or tests * 0.5 ** (one.runs - 1) >= SIGNIFICANT:  # the same sign in all runs would not be enough
        return "too few runs"
    if p >= SIGNIFICANT:
        return "no effect shown"
    return "helps" if one.mean > 0 else "better without"
