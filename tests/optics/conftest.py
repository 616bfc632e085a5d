"""Settings of the tests of `optics`."""

from hypothesis import settings

# The first example of a test compiles a kernel, which takes longer than hypothesis lets an example take.
settings.register_profile("kernels", deadline=None)
settings.load_profile("kernels")
