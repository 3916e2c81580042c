"""The sample head: anatomy by numbers, a mesh laid over it, its textures, lights and cosmetic maps.

No outside mesh is read or copied; every coordinate comes from the landmarks in ``anatomy`` and the formulas here.
"""
