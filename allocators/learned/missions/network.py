"""The network of `gappo` in missions, which scores an agent's options, independent of their number and order."""

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.missions.feature_names import FEATURES, FIRST_SKIP
from alloc.allocators.learned.missions.network_arrays import HIDDEN, WIDTH, MissionWeights, Singles


class MissionNetwork(nn.Module):
    """A network that scores options in the context of all others by attention.

    Options are tasks that the agent knows and can take, exploring, and staying. Each becomes a token; the tokens are
    pooled by attention; the score of an option is computed from its token and the pooled one, plus a linear function of
    its features. For any number of options, it is equivariant to permutations (Zaheer et al. 2017, arXiv:1703.06114;
    pooling by attention as in Lee et al. 2019, arXiv:1810.00825).
    """

    def __init__(self) -> None:
        super().__init__()
        self.inner = nn.Linear(FEATURES, HIDDEN)
        self.query = nn.Linear(HIDDEN, 1, bias=False)
        self.own = nn.Linear(HIDDEN, HIDDEN)
        self.context = nn.Linear(HIDDEN, HIDDEN, bias=False)
        self.out = nn.Linear(HIDDEN, 1, bias=False)
        self.skip = nn.Linear(FEATURES, 1, bias=False)

    def forward(self, options: Tensor, is_option: Tensor) -> Tensor:
        """Return the scores of options.

        Parameters
        ----------
        options : Tensor, shape (batch, options, FEATURES)
        is_option : Tensor of bool, shape (batch, options)
            False for padding.

        Returns
        -------
        scores : Tensor, shape (batch, options)
            ``-inf`` for padding.
        """
        token = nn.functional.leaky_relu(self.inner(options), 0.1)
        attention = self.query(token).squeeze(-1).masked_fill(~is_option, -torch.inf).softmax(-1)
        pooled = (attention.unsqueeze(-1) * token).sum(-2)
        both = nn.functional.leaky_relu(self.own(token) + self.context(pooled).unsqueeze(-2), 0.1)
        scores: Tensor = (self.out(both) + self.skip(options)).squeeze(-1)
        return scores.masked_fill(~is_option, -torch.inf)


def compiled_weights(network: MissionNetwork) -> MissionWeights:
    """Return the weights of the network as arrays for compiled loops."""

    def matrix(layer: nn.Linear, width: int = HIDDEN) -> Singles:
        weight = layer.weight.detach().numpy()
        return np.pad(weight, ((0, 0), (0, width - weight.shape[1]))).astype(np.float32)

    def by_input(layer: nn.Linear) -> Singles:
        return layer.weight.detach().numpy().T.astype(np.float32).ravel()

    def bias(layer: nn.Linear) -> Singles:
        return layer.bias.detach().numpy().astype(np.float32)

    return MissionWeights(
        inner=by_input(network.inner),
        inner_bias=bias(network.inner),
        query=matrix(network.query)[0],
        own=by_input(network.own),
        own_bias=bias(network.own),
        context=by_input(network.context),
        out=matrix(network.out)[0],
        skip=matrix(network.skip, WIDTH)[0],
    )


def first_network(seed: int) -> MissionNetwork:
    """Return an initial network, which is nearly a linear rule.

    The rule prefers near tasks, large shares of work, and tasks that the agent has begun. The hidden layers have small
    random weights.
    """
    generator = torch.Generator().manual_seed(seed)
    network = MissionNetwork()
    with torch.no_grad():
        for name, weight in network.named_parameters():
            scale = 0.0 if name.endswith("bias") else 0.5 / np.sqrt(weight.shape[-1])
            weight.copy_(torch.randn(weight.shape, generator=generator) * scale)
        network.out.weight *= 0.2
        network.skip.weight.copy_(torch.tensor([FIRST_SKIP]))
    return network
