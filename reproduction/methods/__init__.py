"""Planning methods that are compared, one file a baseline."""
