"""The colour of bare skin from its chromophores: melanin over blood, Kubelka-Munk, the air interface on top.

Dermis: K = 2 mua, S = 3/4 mus', reduced scattering 4.6/mm (l/500)^-1.42 and a bloodless background
0.0244 + 8.53 exp(-(l-154)/66.2) per cm (S. L. Jacques, "Optical properties of biological tissues: a review", Phys.
Med. Biol. 58 (2013) R37). Blood: Prahl's molar extinction of HbO2 and Hb, 150 g/l, 64 500 g/mol, 75 % oxygenated.
Melanin: mua = 6.6e10 l^-3.33 per mm times its volume fraction in 60 um of epidermis (Jacques).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

WAVELENGTHS = np.arange(380.0, 781.0, 5.0)
EPIDERMIS_MM = 0.06
MELANIN = np.linspace(0, 0.45, 46)
BLOOD = np.concatenate([np.linspace(0, 0.02, 21), np.linspace(0.025, 0.12, 20)])


def _blood_absorption(chromophores: Path) -> np.ndarray:
    """Absorption of whole blood in 1/mm on the wavelength grid."""
    file = chromophores / "ext_and_molarext_oxy_and_deo_Prahl.txt"
    if not file.exists():
        raise FileNotFoundError(
            f"{file} is missing: the skin's colour needs Prahl's haemoglobin table in ../shared/spectra."
        )
    table = np.loadtxt(file, skiprows=1)
    oxy, deoxy = (np.interp(WAVELENGTHS, table[:, 0], table[:, k]) for k in (1, 2))
    return 2.303 * (0.75 * oxy + 0.25 * deoxy) * 150.0 / 64500.0 / 10.0


def reflectance(melanin: np.ndarray, blood: np.ndarray, chromophores: Path) -> np.ndarray:
    """Apparent diffuse reflectance (..., 81) of skin of given melanin and blood volume fractions."""
    melanin, blood = np.asarray(melanin)[..., None], np.asarray(blood)[..., None]
    scatter = 4.6 * (WAVELENGTHS / 500) ** -1.42
    base = (0.0244 + 8.53 * np.exp(-(WAVELENGTHS - 154) / 66.2)) / 10
    K = 2 * (base + blood * _blood_absorption(chromophores))
    S = 0.75 * scatter
    dermis = S / (K + S + np.sqrt(K * (K + 2 * S)))
    k = 2 * (base + melanin * 6.6e10 * WAVELENGTHS**-3.33) * EPIDERMIS_MM
    s = S * EPIDERMIS_MM
    z = np.sqrt(k * (k + 2 * s))
    tau = np.where(z > 1e-9, np.tanh(z) / np.maximum(z, 1e-9), 1.0)
    D = 1 + (k + s) * tau
    R, T = s * tau / D, 1 / np.cosh(z) / D
    inner = R + T * T * dermis / (1 - R * dermis)
    k1, k2 = 0.0278, 0.50  # n = 1.4: normal Fresnel outside, diffuse inside (softened by the rough surface)
    return (1 - k1) * (1 - k2) * inner / (1 - k2 * inner)


def table(chromophores: Path) -> np.ndarray:
    """Linear Rec.709 under D65 over the MELANIN x BLOOD grid, shape (46, 41, 3)."""
    import colour

    grid = np.meshgrid(MELANIN, BLOOD, indexing="ij")
    R = reflectance(*grid, chromophores)
    shape = colour.SpectralShape(380, 780, 5)
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    light = colour.SDS_ILLUMINANTS["D65"].copy().align(shape).values
    weights = cmfs * light[:, None] / (cmfs[:, 1] * light).sum()
    xyz = R @ weights
    to_rgb = np.array(colour.RGB_COLOURSPACES["sRGB"].matrix_XYZ_to_RGB)
    white = to_rgb @ weights.sum(0)
    return np.clip(xyz @ to_rgb.T / white, 0, 1)


def colour_of(melanin: np.ndarray, blood: np.ndarray, lookup: np.ndarray) -> np.ndarray:
    """Linear Rec.709 (..., 3) of maps of melanin and blood fraction, bilinear in the table."""

    def place(value, axis):
        t = np.interp(value, axis, np.arange(len(axis)))
        i = np.minimum(t.astype(int), len(axis) - 2)
        return i, (t - i)[..., None]

    i, u = place(melanin, MELANIN)
    j, v = place(blood, BLOOD)
    low = lookup[i, j] * (1 - v) + lookup[i, j + 1] * v
    high = lookup[i + 1, j] * (1 - v) + lookup[i + 1, j + 1] * v
    return low * (1 - u) + high * u
