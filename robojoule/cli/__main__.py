"""`python -m robojoule.cli`."""

from robojoule.cli import main

raise SystemExit(main())
