"""The network of the walking policy, and the ONNX file of it.

    products = (obs @ first.T) * (obs @ second.T)
    actions  = concatenate(obs, products) @ weights.T + bias

The products of the commands with the clock let one layer walk at any commanded speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Network:
    """The weights: first and second (k, n_obs), weights (n_act, n_obs + k), bias (n_act,)."""

    first: Floats
    second: Floats
    weights: Floats
    bias: Floats

    def actions(self, observations: Floats) -> Floats:
        """Return the raw actions (..., n_act) of observations (..., n_obs)."""
        products = (observations @ self.first.T) * (observations @ self.second.T)
        features = np.concatenate([observations, products], axis=-1)
        return features @ self.weights.T + self.bias


def write_onnx(network: Network, joint_names: tuple[str, ...], path: Path) -> None:
    """Write the network as ONNX: input `obs` (1, n_obs), output `actions` (1, n_act), float32.

    Args:
        network: The weights.
        joint_names: The joints in the order of the policy; written to the file's metadata.
        path: The file.
    """
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    n_act, n_obs = len(network.bias), network.first.shape[1]
    constants = {
        "first": network.first.T,
        "second": network.second.T,
        "weights": network.weights.T,
        "bias": network.bias,
    }
    graph = helper.make_graph(
        [
            helper.make_node("MatMul", ["obs", "first"], ["left"]),
            helper.make_node("MatMul", ["obs", "second"], ["right"]),
            helper.make_node("Mul", ["left", "right"], ["products"]),
            helper.make_node("Concat", ["obs", "products"], ["features"], axis=1),
            helper.make_node("Gemm", ["features", "weights", "bias"], ["actions"]),
        ],
        "quadruped",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, n_obs])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, [1, n_act])],
        [
            numpy_helper.from_array(np.ascontiguousarray(value, dtype=np.float32), name)
            for name, value in constants.items()
        ],
    )
    model = helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", 17)],
        ir_version=8,
        producer_name="statemachine tools/policy_training",
    )
    helper.set_model_props(model, {"joint_names": ",".join(joint_names)})
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString(deterministic=True))
