"""The game for other people's learners: a PettingZoo and a Gymnasium environment; needs the extra ``env``."""

try:
    from alloc.problems.environments.bidding import BiddingEnv
    from alloc.problems.environments.simultaneous import SimultaneousEnv
except ModuleNotFoundError as error:
    if error.name not in ("gymnasium", "pettingzoo"):
        raise
    message = f"the environments need {error.name}: pip install 'alloc-mrta[env]'"
    raise ModuleNotFoundError(message, name=error.name) from error

__all__ = ["BiddingEnv", "SimultaneousEnv"]
