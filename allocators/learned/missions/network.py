"""The network of `gappo` in missions: it scores an agent's options, whatever their number and order."""

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.missions.feature_names import FEATURES, FIRST_SKIP
from alloc.allocators.learned.missions.network_arrays import HIDDEN, WIDTH, MissionWeights, Singles


class MissionNetwork(nn.Module):
    """Scores of options, each seen beside all others by attention.

    Options are tasks that the agent knows and can take, looking around, and staying. Each becomes a token; the tokens
    are pooled by attention; the score of an option is read from its token and the pooled one, with a linear part of its
    features. Without order and of any number, it is invariant to permutations (Zaheer et al. 2017, arXiv:1703.06114;
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
            False where a row is filled up.

        Returns
        -------
        scores : Tensor, shape (batch, options)
            ``-inf`` where there is no option.
        """
        token = nn.functional.leaky_relu(self.inner(options), 0.1)
        attention = self.query(token).squeeze(-1).masked_fill(~is_option, -torch.inf).softmax(-1)
        pooled = (attention.unsqueeze(-1) * token).sum(-2)
        both = nn.functional.leaky_relu(self.own(token) + self.context(pooled).unsqueeze(-2), 0.1)
        scores: Tensor = (self.out(both) + self.skip(options)).squeeze(-1)
        return scores.masked_fill(~is_option, -torch.inf)


def compiled_weights(network: MissionNetwork) -> MissionWeights:
    """Return the weights that score options."""

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
        context=matrix(network.context),
        out=matrix(network.out)[0],
        skip=matrix(network.skip, WIDTH)[0],
    )


def first_network(seed: int) -> MissionNetwork:
    """Return a network that begins as a plain rule: near tasks, large shares of work, and what was begun.

    Its hidden part has small random weights.
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
