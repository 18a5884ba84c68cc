"""FANUC's teach pendant programs as text (.ls)."""
