"""Files of programs in and out: one reader and writer per kind of file."""
