"""What the parts of GAPPO bring: its population, and each part by a variant that lacks it."""

from collections.abc import Sequence

from alloc.allocators.experiments.reproduction.findings import SIGNIFICANT, table, tested, told
from alloc.allocators.experiments.reproduction.prose import ABLATION
from alloc.allocators.experiments.reproduction.protocol import ABLATIONS, TESTS
from alloc.allocators.experiments.reproduction.rows import Learned
from alloc.allocators.experiments.reproduction.summary import Effect, effect, final, of_scenario
from alloc.allocators.experiments.statistics import holm

GAIN = 0.01
"""p-value, corrected by Holm's procedure, below which the population is said to bring something."""

DECISIVE = 9
"""Runs below which not even the same sign in all of them is below `GAIN`, after Holm over two tests."""

COMPARED = {"makespan": "final T", "drawn": "best of 8 drawn games"}
"""Figures by which parts are judged, in words."""


def population(rows: Sequence[Learned]) -> str:
    """Say whether the population of GAPPO brings anything, by a single member; differences from PPO are told apart."""
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
        return "**What the population brings is not measured**: `gappo` and `gappo-single` have no run in common."
    corrected = holm([one.p for one in known.values()])
    gains = [
        words
        for (words, one), p in zip(known.items(), corrected, strict=True)
        if one.mean < 0 and p is not None and p < GAIN
    ]
    figures = "; ".join(f"{words} {told(one, '+.4f')}" for words, one in known.items())
    if gains:
        return (
            f"**The population brings something** ({', '.join(gains)}; p < {GAIN} after Holm), against one member: "
            f"{figures}."
        )
    few = max(one.runs for one in known.values()) < DECISIVE
    why = f"fewer than {DECISIVE} runs cannot show it" if few else f"no p < {GAIN} after Holm"
    return f"**Nothing is shown to come of the population** ({why}), against one member: {figures}."


def ablations(rows: Sequence[Learned]) -> str:
    """Return the table of the variants that lack a part of `gappo`, on the test games."""
    own = of_scenario(rows, TESTS)
    effects = {(name, figure): effect(own, name, "gappo", final(figure)) for name in ABLATIONS for figure in COMPARED}
    known = {key: one for key, one in effects.items() if one is not None}
    corrected = dict(zip(known, holm([one.p for one in known.values()]), strict=True))
    lines = []
    for name, (part, meaning) in ABLATIONS.items():
        cells = [tested(effects[name, figure], corrected.get((name, figure)), "+.4f") for figure in COMPARED]
        verdict = _without(effects[name, "makespan"], corrected.get((name, "makespan")), len(known))
        lines.append([part, f"`{name}`", meaning, *cells, f"**{verdict}**"])
    header = ["part", "without it", "what that means", *(f"{words}, less `gappo`'s" for words in COMPARED.values())]
    return f"{ABLATION}\n\n" + table([*header, "finding on T"], lines, left=6)


def _without(one: Effect | None, p: float | None, tests: int) -> str:
    """Say what the final makespan without a part shows, where p is corrected for so many tests."""
    if one is None:
        return "not measured"
    if p is None or tests * 0.5 ** (one.runs - 1) >= SIGNIFICANT:  # the same sign in all runs would not be enough
        return "too few runs"
    if p >= SIGNIFICANT:
        return "nothing shown"
    return "brings something" if one.mean > 0 else "better without"
