"""handstudio: from the bytes of a sensor glove to the motion of a human hand."""

__version__ = "0.1.0"
