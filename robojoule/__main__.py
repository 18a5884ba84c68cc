"""`python -m robojoule`: the command line."""

from robojoule.cli import main

raise SystemExit(main())
