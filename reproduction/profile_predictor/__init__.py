"""The predictor of whole profiles, trained on simulated runs; what evaluates it is `robojoule.profile`."""
