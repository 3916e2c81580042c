"""Films of makeup as an instrument reads them, for the tests of fits."""

from __future__ import annotations

import numpy as np

from km_makeup.optics import air_interface, film_over, saunderson, unsaunderson

AIR = air_interface(1.5)
X = np.array([0.015, 0.05, 0.15, 0.015, 0.05, 0.15, np.inf])
READ_G = np.array([0.06, 0.06, 0.06, 0.88, 0.88, 0.88, 0.0])[:, None]


def products(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """K and S of makeup from pale to dark."""
    rng = np.random.default_rng(seed)
    return 10 ** rng.uniform(-1, 2, count), 10 ** rng.uniform(-0.5, 2, count)


def readings(K, S, X=X, R_g=READ_G, interface=AIR, specular_included=True) -> np.ndarray:
    """What an instrument reads of films of K, S on backings that it reads as R_g; inf is the opaque film."""
    X = np.asarray(X).reshape(-1, *[1] * np.ndim(K))
    if interface is None:
        return film_over(K, S, X, R_g)
    inner = np.clip(unsaunderson(R_g, interface, specular_included=specular_included), 0, 1)
    return saunderson(film_over(K, S, X, inner), interface, specular_included=specular_included)


def few(wavelengths: int = 5, noise: float = 0.003) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Noisy readings of three films of one product, their backings, and thicknesses, one of them opaque."""
    wave = np.linspace(0, 1, wavelengths)
    K, S, X, R_g = (
        np.exp(1.5 * np.sin(5 * wave)),
        np.exp(3 - wave),
        np.array([0.02, 0.08, np.inf]),
        np.array([[0.8], [0.1], [0.5]]),
    )
    R = readings(K, S, X, R_g) + np.random.default_rng(4).normal(0, noise, (3, wavelengths))
    return R, R_g, X


def slopes(theta: np.ndarray, R_g: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Derivatives of the readings to ln K and ln S, (films, wavelengths, 2), by differences of the model itself."""
    h = 1e-6
    steps = (np.array([[h], [0]]), np.array([[0], [h]]))
    return np.stack(
        [(readings(*np.exp(theta + s), X, R_g) - readings(*np.exp(theta - s), X, R_g)) / (2 * h) for s in steps],
        axis=-1,
    )
