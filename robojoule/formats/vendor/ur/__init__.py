"""Universal Robots' URScript: .script files."""
