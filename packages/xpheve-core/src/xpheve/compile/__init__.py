"""Generated text, interpreted or compiled: one text, two speeds, same bits. The only door to numba and llvmlite.

`assemble` puts the kernel functions that a text calls before it; `interpreted` and `compiled` make a `Kernel` of it, which is called on
arrays. Compiled code is kept in the user's cache folder; from there it is loaded without numba.
"""

from xpheve.compile.assemble import assemble
from xpheve.compile.kernel import Kernel
from xpheve.compile.progress import on_compile
from xpheve.compile.tiers import compiled, facts, interpreted

__all__ = ["Kernel", "assemble", "compiled", "facts", "interpreted", "on_compile"]
