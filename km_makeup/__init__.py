"""KM Makeup: physically based makeup from spectral Kubelka-Munk films.

Importing this package imports nothing heavy; the floors below are imported where they are used.
"""

__version__ = "0.1.0"
