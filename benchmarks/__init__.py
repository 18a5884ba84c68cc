"""Speed and memory against plain ways and floors; `make bench` runs them all."""
