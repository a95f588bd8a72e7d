"""A policy on a model of an engine, as its contract wants it."""

from __future__ import annotations

from dataclasses import dataclass

from ...interface import Model
from .adapted import AdaptedModel, adapted
from .binding import Binding, bind
from .contract import Contract
from .network import Network


@dataclass(frozen=True)
class PolicyOnModel:
    """A policy on a model of an engine, as its contract wants it.

    Attributes:
        contract: What the policy expects.
        network: The policy.
        binding: Where the joints and sensors of the contract are in the model.
        driven: The model that is run, and how its joints are driven.
    """

    contract: Contract
    network: Network
    binding: Binding
    driven: AdaptedModel

    @classmethod
    def of(cls, contract: Contract, network: Network, model: Model) -> PolicyOnModel:
        """Return a policy on a model.

        Args:
            contract: What the policy expects.
            network: The policy.
            model: As its file has it.

        Raises:
            BadInputError: The contract and the model do not fit together.
            UnsupportedError: The engine cannot change what the contract says otherwise.
        """
        binding = bind(contract, model)
        return cls(contract, network, binding, adapted(model, contract, binding))
