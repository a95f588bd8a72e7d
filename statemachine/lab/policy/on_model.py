"""A policy on a model of an engine, as its contract wants it or as its file has it."""

from __future__ import annotations

from dataclasses import dataclass

from ...interface import Model
from .adapted import AdaptedModel, adapted, unchanged
from .binding import Binding, bind
from .contract import Contract
from .network import Network


@dataclass(frozen=True)
class PolicyOnModel:
    """A policy on a model of an engine.

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
        """Return a policy on a model, which is made as the contract wants it.

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

    @classmethod
    def as_filed(cls, contract: Contract, network: Network, model: Model) -> PolicyOnModel:
        """Return a policy on a model whose servos, limits and timestep stay as they are.

        Args:
            contract: What the policy expects; of servos only the gains, where the model has motors.
            network: The policy.
            model: What is run.

        Raises:
            BadInputError: The contract and the model do not fit together, or the time between two
                calls of the policy is no whole number of timesteps.
        """
        binding = bind(contract, model)
        return cls(contract, network, binding, unchanged(model, contract, binding))
