"""KUKA KRL: .src files with the .dat that goes with them."""
