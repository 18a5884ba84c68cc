"""Optimisation graph, planning model, methods, write-back: from operation trees and profiles to verified plans."""
