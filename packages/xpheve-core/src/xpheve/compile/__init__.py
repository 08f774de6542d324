"""Generated text, interpreted or compiled: one text, two speeds, same bits. The only door to numba and llvmlite."""
