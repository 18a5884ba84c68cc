"""What a robot does in one cycle: operation trees and programs."""
