"""`python -m evslip`, the same as the command `evslip`."""

from evslip.cli import main

main()
