"""`python -m dcmp_hil` is `dcmp-hil`."""

from dcmp_hil.cli import main

if __name__ == "__main__":
    main()
