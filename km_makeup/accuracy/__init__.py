"""Error and time of every shortcut: how pictures and colours differ from what they should be.

numpy only; FLIP where flip-evaluator is installed.
"""

from .pictures import PictureDifference, Spread, compare_pictures, flip_map, map_colours, noise_floor

__all__ = ["PictureDifference", "Spread", "compare_pictures", "flip_map", "map_colours", "noise_floor"]
