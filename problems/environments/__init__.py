"""PettingZoo and Gymnasium environments of the game and of missions; needs the extra ``env``."""

try:
    from alloc.problems.environments.bidding import BiddingEnv
    from alloc.problems.environments.missions.agents import MissionEnv
    from alloc.problems.environments.missions.fleet import MissionFleetEnv
    from alloc.problems.environments.simultaneous import SimultaneousEnv
except ModuleNotFoundError as error:
    if error.name not in ("gymnasium", "pettingzoo"):
        raise
    message = f"the environments need {error.name}: pip install 'alloc-mrta[env]'"
    raise ModuleNotFoundError(message, name=error.name) from error

__all__ = ["BiddingEnv", "MissionEnv", "MissionFleetEnv", "SimultaneousEnv"]
