"""Features of an option for the network of `gappo` in missions: their indices, and the weights of an initial rule."""

(
    TRAVEL,
    WITH_ME,
    WITHOUT,
    IS_ORDER,
    IS_WORK,
    OTHERS,
    IS_ALONE,
    STRENGTH,
    WORK,
    IS_LATE,
    AGE,
    SHARE,
    CROWDING,
    GAIN,
    PRIORITY,
    SLACK,
    MISSES,
    GROWTH,
    ENERGY,
    RIVALS,
    EXPLORES,
    STAYS,
    UNSEEN,
    TASKS_PER_AGENT,
    KNOWN_AGENTS,
    WORK_AHEAD,
) = range(26)
"""Hours of travel, until it is done with the agent and without; whether it is the last order, and work goes on there;
others there or coming, none; the agent's ability and its hours for the work; whether others end before it arrives; age
of what is known; share of the time that would be work; other work near by; hours gained; priority; hours before the
deadline, which it misses; growth; energy; agents without a task that are nearer; whether the option is to explore,
or to stay; how long a place was not seen; and of the whole situation: known tasks per agent, agents, work of all."""

FEATURES = 26
FEATURE_SET = "missions/1"

FIRST_WEIGHTS = {
    TRAVEL: -3.0,
    WITH_ME: -1.0,
    IS_ORDER: 1.0,
    IS_WORK: 0.5,
    OTHERS: -0.5,
    IS_LATE: -3.0,
    SHARE: 2.0,
    GAIN: 1.0,
    PRIORITY: 0.3,
    MISSES: -1.0,
    EXPLORES: -1.5,
    STAYS: -3.0,
    UNSEEN: 0.3,
}
SHARPNESS = 6.0
"""Factor on these weights, with which samples of the initial network seldom differ from its best option."""

FIRST_SKIP = [SHARPNESS * FIRST_WEIGHTS.get(feature, 0.0) for feature in range(FEATURES)]
"""Linear weights of the rule with which training begins."""
