"""The distance of every visible person from one ordinary RGB camera."""

__version__ = '0.1.0'
