"""A policy's network as an ONNX file, for robot controllers and other runtimes.

Needs the package ``onnx`` (``pip install 'bimvox[onnx]'``).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT, INPUT_SIZE, VIEW_SIZE
from bimvox.errors import PolicyError
from bimvox.policy.network import QNetwork

_OPSET = 17
"""Of the standard operators: read by every runtime since 2022, and Gemm and Relu have not changed since."""
_INPUT, _OUTPUT = "observation", "action_values"
_CHECKED = 256
_TOLERANCE = 1e-5


def onnx_bytes(network: QNetwork, facts: Mapping[str, str]) -> bytes:
    """Return a network as an ONNX model: ``observation`` (batch, VIEW_SIZE) float32 -> ``action_values`` (batch, 6).

    The model is first checked by ONNX's checker, and compared with :class:`QNetwork` on 256 observations by ONNX's
    reference implementation.

    ``facts``: metadata of the model.

    Raises:
        PolicyError: The package is missing, or the model and the network disagree.
    """
    try:
        import onnx
        from onnx import TensorProto, helper, numpy_helper
        from onnx.reference import ReferenceEvaluator
    except ImportError as error:
        raise PolicyError(
            "ONNX files need the package onnx, which is not installed", hint="pip install 'bimvox[onnx]'"
        ) from error
    constants = [
        numpy_helper.from_array(np.array(numbers, kind), name)
        for name, numbers, kind in (
            ("first", [0], np.int64),
            ("inputs", [network.layer_sizes[0]], np.int64),
            ("before", [INPUT_SIZE], np.int64),
            ("view", [VIEW_SIZE], np.int64),
            ("columns", [1], np.int64),
            ("frames", FRAME_COUNT - 1, np.float32),
            ("lowest", 0, np.float32),
            ("frame_actions", FRAME_ACTIONS, np.int64),
            ("axis", [1], np.int64),
        )
    ]
    nodes = [
        helper.make_node("Slice", [_INPUT, "first", "inputs", "columns"], ["seen"]),
        helper.make_node("Slice", [_INPUT, "before", "view", "columns"], ["share"]),
        helper.make_node("Mul", ["share", "frames"], ["scaled"]),
        helper.make_node("Round", ["scaled"], ["rounded"]),
        helper.make_node("Clip", ["rounded", "lowest", "frames"], ["clipped"]),
        helper.make_node("Cast", ["clipped"], ["cast"], to=TensorProto.INT64),
        helper.make_node("Squeeze", ["cast", "axis"], ["frame"]),
        helper.make_node("Gather", ["frame_actions", "frame"], ["order"], axis=0),
    ]
    value = "seen"
    last = len(network.weights) - 1
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        constants.append(numpy_helper.from_array(np.ascontiguousarray(weight), f"layer{layer}.weight"))
        constants.append(numpy_helper.from_array(np.ascontiguousarray(bias), f"layer{layer}.bias"))
        summed = f"sum{layer}"
        nodes.append(helper.make_node("Gemm", [value, f"layer{layer}.weight", f"layer{layer}.bias"], [summed]))
        value = summed
        if layer != last:
            nodes.append(helper.make_node("Relu", [summed], [f"hidden{layer}"]))
            value = f"hidden{layer}"
    if network.is_framed:
        nodes.append(helper.make_node("GatherElements", [f"sum{last}", "order"], [_OUTPUT], axis=1))
    else:
        nodes.append(helper.make_node("Identity", [f"sum{last}"], [_OUTPUT]))
    sizes = network.layer_sizes
    graph = helper.make_graph(
        nodes,
        "bimvox-policy",
        [helper.make_tensor_value_info(_INPUT, TensorProto.FLOAT, ["batch", VIEW_SIZE])],
        [helper.make_tensor_value_info(_OUTPUT, TensorProto.FLOAT, ["batch", sizes[-1]])],
        constants,
    )
    model = helper.make_model(
        graph, producer_name="bimvox", opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=8
    )
    helper.set_model_props(model, dict(sorted(facts.items())))
    onnx.checker.check_model(model, full_check=True)
    asked = np.random.default_rng(0).uniform(-1.0, 1.0, (_CHECKED, VIEW_SIZE)).astype(np.float32)
    (found,) = ReferenceEvaluator(model).run([_OUTPUT], {_INPUT: asked})
    wanted = network(asked)
    worst = float(np.abs(found - wanted).max() / max(1.0, float(np.abs(wanted).max())))
    if not worst <= _TOLERANCE:
        raise PolicyError(f"the ONNX model differs from the network by {worst:.2g} of its largest value")
    return bytes(model.SerializeToString(deterministic=True))
