"""Settings of the tests of `optics`."""

import os

from hypothesis import settings

# The first example of a test compiles a kernel, which takes longer than hypothesis lets an example take. CI draws the
# same examples every time, so that it fails for a change and not by chance; on a desk they are new each time.
settings.register_profile("kernels", deadline=None, derandomize=os.environ.get("CI") == "true")
settings.load_profile("kernels")
