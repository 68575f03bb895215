"""``python -m cityflow``."""

from cityflow.cli import main

if __name__ == "__main__":
    main()
