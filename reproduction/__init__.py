"""The thesis run again on the library, and everything that is judged against it."""
