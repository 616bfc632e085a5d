"""Trees taken apart and put together, and frozen functions that take and return them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from optics.kernels.backend import Float32
from optics.kernels.freezing import Flat, frozen
from optics.kernels.trees import leaves_of, structure_of


@dataclass(frozen=True, kw_only=True)
class Weights:
    left: Any = None
    right: Any = None


def test_a_tree_comes_back_from_its_leaves():
    tree = {"a": Weights(left=1, right=(Weights(left=2), Weights(left=3))), "b": [4, 5]}
    assert leaves_of(tree) == [1, 2, 3, [4, 5]]
    assert structure_of(tree).filled(iter(leaves_of(tree))) == tree


def test_a_leaf_has_no_structure():
    with pytest.raises(TypeError, match="expected a dataclass, a dict or a tuple"):
        structure_of(1.0)


def test_a_frozen_function_keeps_structures_apart():
    """As many leaves, but for another field: another function. Replayed, it computes with what it is given."""

    @frozen()
    def scaled(weights, values):
        either = weights.left if weights.right is None else -weights.right
        return Weights(left=values * either)

    for factor in (2.0, 3.0):
        for weights, sign in ((Weights(left=Float32(factor)), 1), (Weights(right=Float32(factor)), -1)):
            result = scaled(Flat(weights), Float32([1, 2]))
            assert isinstance(result, Weights)
            np.testing.assert_allclose(result.left.numpy(), sign * factor * np.array([1, 2]))
