"""The studio: a rig that one can touch, on a local web page; the model knows nothing of the page."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
