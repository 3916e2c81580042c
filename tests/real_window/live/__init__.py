"""How much Python of KM Makeup runs while a brush moves."""
