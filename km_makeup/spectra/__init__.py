"""Spectra on 380-780 nm and their colours: lights, bands, working spaces, differences, skin upsampling.

colour-science does the colorimetry and is imported only inside the functions that need it.
"""

from .bands import Bands, bands, to_rgb
from .difference import delta_e, lab
from .gamut import GamutReport, fit_gamut
from .grid import WAVELENGTHS, resample
from .lights import light_spectrum
from .skin import upsample_skin
from .skin_data import reference_skins
from .skin_model import SkinModel, fit_skin
from .spaces import SPACES, convert

__all__ = [
    "SPACES",
    "WAVELENGTHS",
    "Bands",
    "GamutReport",
    "SkinModel",
    "bands",
    "convert",
    "delta_e",
    "fit_gamut",
    "fit_skin",
    "lab",
    "light_spectrum",
    "reference_skins",
    "resample",
    "to_rgb",
    "upsample_skin",
]
