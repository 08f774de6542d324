"""``python -m xpheve`` is the command ``xpheve``."""

from xpheve.cli import main

if __name__ == "__main__":
    main()
