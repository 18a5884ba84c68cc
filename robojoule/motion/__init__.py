"""Physics of motions: paths, time laws and the controller's rule, torques, energy integrals, runs."""
