"""The DVC stages: thin shells around the domain library, one module a stage."""
