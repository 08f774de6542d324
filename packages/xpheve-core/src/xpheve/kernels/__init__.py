"""Plain arithmetic on floats and tuples: interpreted for small scenes, compiled for large ones.

A kernel imports only ``math`` and other kernels; it knows no object and raises no error.
"""
