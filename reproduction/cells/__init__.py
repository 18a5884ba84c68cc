"""What it brings to plan the robots of a cell together."""
