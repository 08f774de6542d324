"""Laws of touching bodies."""
__version__ = "0.1.0"
