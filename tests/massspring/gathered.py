"""One pass of springs and volume from given positions, for tests: in a step the positions are padded already."""

from massspring.kernels.fused.chunk import pad_positions
from massspring.kernels.fused.sweep import predict_from_places
from massspring.kernels.jit.decorators import njit_lean


@njit_lean
def gather_and_predict(model, nodes, work, boundary, keeps):
    """v* and (V, G·v*, G·W·G) from `x`, as `predict_from_places`."""
    pad_positions(nodes, work, 0, nodes.x.shape[0])
    return predict_from_places(model, nodes, work, boundary, keeps)
