"""The live colour path as it is rendered, against 81 bands: random stacks, and what lies at the edges of what is painted."""
