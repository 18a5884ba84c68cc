"""Planning methods that are compared, one file per method; `registry` knows them by name."""
