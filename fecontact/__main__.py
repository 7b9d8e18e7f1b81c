"""`python -m fecontact`: the same as the program `fecontact`."""

from fecontact.cli import main

if __name__ == "__main__":
    main()
