"""Energy-optimal speed plans for robotic cells."""

__version__ = "0.1.0"
