"""The methods that ship with the package, described without importing them."""

from alloc.allocators.contract.method import Kind, Method

BUILT_IN = {
    method.name: method
    for method in (
        Method(
            name="greedy",
            summary="largest ability first, to the task that is worst served",
            finite_speeds=True,
            citation="Deuermeyer, Friesen and Langston (1982), doi:10.1137/0603019",
        ),
        Method(
            name="local-search",
            summary="simulated annealing over exchanges between two groups, each repartitioned at the least cost",
            requires=("numba",),
            finite_speeds=True,
            warm_start=True,
            anytime=True,
            makespan_slack=True,
            citation="Ahuja, Ergun, Orlin and Punnen (2002), doi:10.1016/S0166-218X(01)00338-9",
        ),
        Method(
            name="milp",
            summary="proven optimum by a mixed-integer programme over classes of agents (cvxpy + HiGHS)",
            kind=Kind.EXACT,
            requires=("cvxpy", "highspy"),
            finite_speeds=True,
            makespan_slack=True,
            proves=True,
            warm_start=True,
            anytime=True,
            options=("plain",),
            citation="Huangfu and Hall (2018), doi:10.1007/s12532-017-0130-5",
        ),
        Method(
            name="cpsat",
            summary="proven optimum by constraint programming over classes of agents (OR-Tools)",
            kind=Kind.EXACT,
            requires=("ortools",),
            finite_speeds=True,
            makespan_slack=True,
            proves=True,
            warm_start=True,
            anytime=True,
            options=("plain",),
            citation="Perron, Didier and Gay (2023), doi:10.4230/LIPIcs.CP.2023.3",
        ),
        Method(
            name="ga",
            summary="genetic algorithm over assignments (DEAP)",
            requires=("deap",),
            warm_start=True,
            anytime=True,
            citation="Fortin et al. (2012), JMLR 13:2171-2175",
        ),
        Method(
            name="hedonic",
            summary="decentralised coalition-formation game: agents decide on local communication (GRAPE)",
            makespan_slack=True,
            warm_start=True,
            anytime=True,
            options=("communication_radius",),
            citation="Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292",
        ),
        Method(
            name="auction",
            summary="decentralised auction: tasks bid for agents until a deadline is met, then agents exchange places",
            makespan_slack=True,
            warm_start=True,
            anytime=True,
            citation="Bertsekas (1992), doi:10.1007/BF00247653",
        ),
        Method(
            name="lp-round",
            summary="linear programme over classes of agents, rounded by a matching, mended by local search",
            finite_speeds=True,
            makespan_slack=True,
            warm_start=True,
            anytime=True,
            citation="Shmoys and Tardos (1993), doi:10.1007/BF01585178",
        ),
        *(
            Method(
                name=name,
                summary=summary,
                kind=Kind.LEARNED,
                requires=("torch", "safetensors", *more),
                finite_speeds=True,
                makespan_slack=True,
                warm_start=True,
                anytime=True,
                options=("policy", "device"),
                citation=citation,
            )
            for name, summary, more, citation in (
                (
                    "gappo",
                    "learned policies: a population of actor-critics, trained by PPO and bred by a GA",
                    ("deap",),
                    "Fang et al. (2025), doi:10.20944/preprints202502.0192.v1",
                ),
                (
                    "gappo-ls",
                    "hybrid: the first plan of gappo, improved by local-search",
                    ("deap", "numba"),
                    "Fang et al. (2025), doi:10.20944/preprints202502.0192.v1",
                ),
                ("ppo", "learned policy: proximal policy optimisation", (), "Schulman et al. (2017), arXiv:1707.06347"),
                ("a2c", "learned policy: advantage actor-critic", (), "Mnih et al. (2016), arXiv:1602.01783"),
                ("dqn", "learned policy: deep Q-network", (), "Mnih et al. (2015), doi:10.1038/nature14236"),
                (
                    "ddpg",
                    "learned policy: deep deterministic policy gradient, over relaxed choices",
                    (),
                    "Lillicrap et al. (2016), arXiv:1509.02971",
                ),
            )
        ),
    )
}
