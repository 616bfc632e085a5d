"""Powers: the cheap ones against NumPy's in double precision."""

import numpy as np

from optics.kernels.backend import Float32
from optics.kernels.powers import decay, power_of_two


def test_power_of_two():
    exponent = np.linspace(-20, 20, 40_001).astype(np.float32)
    np.testing.assert_allclose(power_of_two(Float32(exponent)), 2.0 ** exponent.astype(np.float64), rtol=4e-6)


def test_decay():
    """To 4e-6 up to an optical depth of ten; of the deepest sea nothing is left, and no more than that."""
    depth = np.linspace(-3, 10, 40_001).astype(np.float32)
    np.testing.assert_allclose(decay(Float32(depth)), np.exp(-depth.astype(np.float64)), rtol=4e-6)
    nothing = np.array(decay(Float32(np.array([80.0, 100.0, 1e6], dtype=np.float32))))
    assert (nothing >= 0).all()
    assert (nothing < 1e-34).all()
