"""Where things lie on the sample head: landmarks and curves in millimetres.

Frame: x to the head's left, y up, z forward; y = 0 at the height of the pupils, z = 0 at the tragion.
Distances follow the means for young North American white women in L. G. Farkas, "Anthropometry of the Head and
Face" (2nd ed., Raven Press 1994) and Farkas et al., "International anthropometric study of facial morphology in
various ethnic groups/races", J. Craniofac. Surg. 16 (2005) 615-646, rounded to the millimetre and within one
standard deviation: v-gn 218, n-gn 112, n-sn 49, tr-n 63, zy-zy 130, go-go 94, en-en 32, ex-ex 88, al-al 32,
sn-prn 20, ch-ch 50, eu-eu 145, g-op 187, t-sn 122, t-gn 133. Only the half x >= 0 is given; the other is its mirror.
"""

from __future__ import annotations

import numpy as np

EYE_CENTRE = np.array([31.3, 0.0, 64.6])
EYE_RADIUS = 12.2
IRIS_RADIUS = 5.9
LID_THICKNESS = 1.7

# Points that the skin passes through (nose, lips and lids excepted, which have their own forms).
SKIN_POINTS = np.array(
    [
        # midline
        (0, 116, 4), (0, 100, 52), (0, 88, 69), (0, 73, 81), (0, 55, 90), (0, 40, 93.5), (0, 25, 94), (0, 14, 90),
        (0, -78.5, 91.5), (0, -84, 93.2), (0, -91, 94), (0, -97, 91.5), (0, -102, 85), (0, -104, 76),
        (0, -105.5, 60), (0, -107.5, 43), (0, -115, 33), (0, -130, 26), (0, -150, 17), (0, -172, 10),
        (0, 110, -40), (0, 80, -78), (0, 40, -92), (0, 0, -89), (0, -25, -79), (0, -52, -64), (0, -82, -58), (0, -115, -62), (0, -150, -74),
        # forehead and temple
        (25, 75, 75), (45, 73, 58), (60, 70, 30), (20, 45, 90.5), (40, 45, 79), (55, 45, 60), (63, 45, 42), (72, 42, 0),
        (20, 30, 90.5), (40, 30, 81.5), (55, 30, 62), (64, 25, 38),
        # brow
        (12, 19, 91), (25, 20.5, 89), (38, 20, 82), (49, 16, 71), (57, 13, 58), (64, 10, 38), (70, 10, 5),
        # beside the eye and on the cheek
        (54, 0, 58.5), (62, 0, 38), (69, 0, 5),
        (30, -19, 79.5), (40, -19, 76.5), (50, -18, 68.0), (60, -16, 49), (65.5, -15, 34), (67, -22, 5),
        (16, -14, 80.5), (20, -24, 84.5),
        (21, -38, 88.5), (30, -35, 84.5), (40, -35, 77.0), (51, -37, 60.5), (59.5, -38, 36), (63, -40, 6),
        # mouth region and jaw
        (0, -44.5, 98.6), (12, -46, 97.0), (0, -50, 99.8), (9, -50, 98.4), (16, -53, 94.6), (22, -50, 90.5), (0, -73.5, 93.6), (10, -72.5, 92.4), (18, -69, 89.2), (30, -50, 84.0), (40, -53, 73.0), (47.5, -55, 53), (53.5, -56, 30), (56, -56, 10),
        (29, -61, 82.6), (36, -63, 75), (38, -68, 65), (45.5, -68, 44), (50.5, -68, 18), (48, -75, 8),
        (15, -76, 88.0), (26, -76, 78.0), (35, -78, 61.5), (42.5, -75, 38),
        (10, -91, 91.2), (19, -90, 83), (28, -88, 68), (36, -84.5, 49), (42, -80, 31),
        (9.5, -101.5, 81.5), (18.5, -98.5, 71), (26.5, -95, 57),
        (15, -105, 60), (25, -100.5, 45), (20, -106, 38), (38, -92, 20),
        # neck
        (43, -98, -20), (40, -125, -24), (40, -96, -37), (28, -120, 13), (30, -118, -50), (41, -150, -30),
        # skull
        (73.5, 45, -10), (72, 15, -30), (66, 60, -45), (45, 60, -75), (60, 20, -65), (55, 90, 0), (40, 95, 40), (40, 95, -50),
        (58, -20, -50), (54, -50, -38), (40, -60, -52),
    ],
    dtype=float,
)  # fmt: skip

# Lid margins in the frontal plane: inner canthus, over the top to the outer canthus; and along the bottom.
CANTHUS_INNER = np.array([16.6, -2.0, 72.5])
CANTHUS_OUTER = np.array([46.4, 2.0, 65.9])
LID_UPPER = np.array(
    [(16.6, -2.0), (18.8, 0.6), (22.3, 3.1), (26.8, 4.6), (31.0, 4.9), (36.0, 4.6), (41.2, 3.7), (46.4, 2.0)]
)
LID_LOWER = np.array(
    [(16.6, -2.0), (19.5, -3.0), (24.0, -4.6), (29.0, -5.8), (34.0, -5.8), (39.0, -4.5), (43.2, -1.7), (46.4, 2.0)]
)
CREASE = np.array(
    [(18.0, 4.4), (21.5, 7.4), (26.5, 9.5), (31.5, 10.2), (37.0, 10.0), (42.5, 8.6), (47.5, 5.6), (51.0, 2.4)]
)

# Lips from the midline to the corner (x, y, z): five rails from the upper vermilion border to the lower.
LIP_RAILS = {
    "upper border": np.array([(0, -53.3, 100.6), (2.6, -52.3, 100.8), (5.6, -51.4, 100.4), (9.5, -51.8, 98.9), (13.5, -53.2, 96.4), (17.5, -55.1, 93.0), (20.8, -56.9, 89.7), (23.2, -58.5, 86.9), (24.4, -60.2, 85.2)]),
    "upper fullness": np.array([(0, -57.6, 103.5), (2.6, -57, 103.3), (5.6, -56.2, 102.8), (9.5, -56.2, 101.4), (13.5, -56.9, 98.8), (17.5, -57.8, 95.1), (20.8, -58.7, 91), (23.2, -59.5, 87.3), (24.4, -60.25, 84.9)]),
    "upper wet": np.array([(0, -62.2, 101.1), (2.6, -61.9, 100.9), (5.6, -61.1, 100.3), (9.5, -60.5, 98.6), (13.5, -60.4, 95.7), (17.5, -60.5, 92), (20.8, -60.5, 88.2), (23.2, -60.4, 85.3), (24.4, -60.3, 83.9)]),
    "lower wet": np.array([(0, -62.24, 100.7), (2.6, -61.94, 100.5), (5.6, -61.14, 99.9), (9.5, -60.54, 98.2), (13.5, -60.44, 95.3), (17.5, -60.54, 91.7), (20.8, -60.54, 88), (23.2, -60.44, 85.2), (24.4, -60.34, 83.9)]),
    "lower fullness": np.array([(0, -66.9, 101.9), (2.6, -66.9, 102.1), (5.6, -66.6, 101.9), (9.5, -65.9, 100.3), (13.5, -64.8, 97.4), (17.5, -63.4, 93.4), (20.8, -62.2, 89.8), (23.2, -61.2, 86.8), (24.4, -60.35, 84.9)]),
    "lower border": np.array([(0, -72.0, 97.2), (2.6, -72.0, 97.1), (5.6, -71.7, 96.7), (9.5, -70.6, 95.3), (13.5, -68.7, 93.2), (17.5, -66.2, 90.8), (20.8, -63.9, 88.3), (23.2, -62.1, 86.4), (24.4, -60.4, 85.2)]),
}  # fmt: skip

NOSTRIL = np.array([7.5, -40.2, 101.6])

BROW = np.array([(12.0, 15.2), (19, 16.8), (28, 18.6), (37, 19.9), (45, 19.2), (53.0, 15.0)])


def unevenness(p: np.ndarray) -> np.ndarray:
    """Points (n, 3) of the mirrored head moved by up to 0.8 mm: no face is its own mirror image.

    Brow, nose tip, corners of the mouth and chin only, so that lids and eyeballs keep fitting.
    """
    x, y, z = np.asarray(p, float).T
    front = 1 / (1 + np.exp(-(z - 45) / 6))
    left = np.tanh(x / 14)

    def near(height: float, width: float) -> np.ndarray:
        return np.exp(-0.5 * ((y - height) / width) ** 2)

    tip = 0.6 * np.exp(-0.5 * (((y + 33) / 8) ** 2 + (x / 12) ** 2)) * (z > 80)
    dx = (tip - 0.7 * near(-92, 12)) * front
    dy = (0.55 * left * near(-60, 9) - 0.6 * left * near(20, 4.5)) * front
    return np.column_stack([x + dx, y + dy, z])
