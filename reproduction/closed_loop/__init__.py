"""Plans on controllers that nobody has described: what trials on hidden machines bring."""
