"""One plan as a page to look at: a single file for a browser, which needs no network."""
