"""python -m virtualrig: the command line."""

from virtualrig.cli import main

if __name__ == "__main__":
    main()
