"""Makes answers again: ``python -m benchmarks.references NAME...`` (minutes each; needs heyoka)."""

from __future__ import annotations

import sys
import time

from benchmarks.references import make

if __name__ == "__main__":
    for name in sys.argv[1:] or list(make.MAKERS):
        begin = time.time()
        print(name, make.MAKERS[name](), f"{time.time() - begin:.1f} s", flush=True)
