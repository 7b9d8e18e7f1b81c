"""`python -m fecontact`: equal to the program `fecontact`."""

from fecontact.cli import main

if __name__ == "__main__":
    main()
