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
        (0, -105.5, 60), (0, -107, 42), (0, -114, 30), (0, -130, 25), (0, -150, 20.5),
        (0, 110, -40), (0, 80, -78), (0, 40, -92), (0, 0, -90), (0, -30, -78), (0, -60, -67), (0, -90, -64), (0, -120, -66),
        # forehead and temple
        (25, 75, 75), (45, 73, 58), (60, 70, 30), (20, 45, 90.5), (40, 45, 79), (55, 45, 60), (63, 45, 42), (72, 42, 0),
        (20, 30, 90.5), (40, 30, 81.5), (55, 30, 62), (64, 25, 38),
        # brow
        (12, 19, 91), (25, 20.5, 89), (38, 20, 82), (49, 16, 71), (57, 13, 58), (64, 10, 38), (70, 10, 5),
        # beside the eye and on the cheek
        (54, 0, 58.5), (62, 0, 38), (69, 0, 5),
        (30, -19, 79.0), (40, -19, 75.5), (50, -18, 66.5), (60, -17, 46), (65, -17, 33), (67, -22, 5),
        (16, -14, 80.5), (20, -24, 84.5),
        (21, -38, 88.5), (30, -36, 83.5), (40, -36, 75.5), (51, -36, 60), (60, -36, 36), (65, -38, 6),
        # mouth region and jaw
        (0, -44.5, 98.6), (12, -46, 97.0), (0, -50, 99.8), (9, -50, 98.4), (16, -53, 94.6), (22, -50, 90.5), (0, -73.5, 93.6), (10, -72.5, 92.4), (18, -69, 89.2), (30, -50, 84.5), (40, -52, 73.5), (50, -54, 54), (57, -54, 30), (59, -54, 10),
        (29, -61, 83.0), (36, -62, 76), (40, -67, 66), (48, -66, 45), (53, -66, 18), (49, -74, 10),
        (15, -76, 88.5), (27, -76, 79), (37, -78, 63), (45, -75, 40),
        (10, -91, 91.7), (20, -90, 84), (30, -88, 69), (38, -84.5, 50), (44, -80, 32),
        (10, -101.5, 82), (20, -98.5, 72), (28, -95, 58),
        (15, -105, 60), (25, -100.5, 45), (20, -106, 38), (38, -92, 20),
        # neck
        (50, -100, -15), (48, -125, -18), (48, -98, -35), (34, -120, 10), (37, -120, -52), (48, -150, -22),
        # skull
        (73.5, 45, -10), (72, 15, -30), (66, 60, -45), (45, 60, -75), (60, 20, -65), (55, 90, 0), (40, 95, 40), (40, 95, -50),
        (58, -20, -50), (56, -50, -40),
    ],
    dtype=float,
)  # fmt: skip

# Lid margins in the frontal plane: inner canthus, over the top to the outer canthus; and along the bottom.
CANTHUS_INNER = np.array([16.6, -1.8, 72.5])
CANTHUS_OUTER = np.array([45.6, 1.4, 66.2])
LID_UPPER = np.array(
    [(16.6, -1.8), (18.9, 0.4), (22.3, 2.7), (26.8, 4.2), (31.5, 4.6), (36.2, 4.3), (41.0, 3.2), (45.6, 1.4)]
)
LID_LOWER = np.array(
    [(16.6, -1.8), (19.5, -2.8), (24.0, -4.3), (29.0, -5.4), (34.0, -5.5), (38.8, -4.3), (42.6, -1.9), (45.6, 1.4)]
)
CREASE = np.array(
    [(18.5, 4.6), (22.0, 7.4), (26.5, 9.3), (31.5, 9.9), (37.0, 9.6), (42.0, 8.1), (46.5, 5.4), (49.5, 2.8)]
)

# Lips from the midline to the corner (x, y, z): five rails from the upper vermilion border to the lower.
LIP_RAILS = {
    "upper border": np.array([(0, -53.0, 100.8), (5.0, -51.6, 100.6), (10.5, -53.2, 98.6), (16, -55.9, 94.9), (20.5, -58.4, 90.6), (24.6, -60.7, 86.4)]),
    "upper fullness": np.array([(0, -57.3, 103.4), (5.0, -56.4, 102.7), (10.5, -56.9, 100.5), (16, -58.3, 96.5), (20.5, -59.7, 91.3), (24.6, -60.8, 86.0)]),
    "upper wet": np.array([(0, -60.9, 101.2), (5.0, -60.1, 100.6), (10.5, -59.6, 98.6), (16, -60.0, 94.8), (20.5, -60.6, 89.8), (24.6, -60.9, 85.2)]),
    "lower wet": np.array([(0, -61.2, 101.0), (5.0, -60.6, 100.4), (10.5, -60.1, 98.4), (16, -60.4, 94.5), (20.5, -60.8, 89.6), (24.6, -61.0, 85.2)]),
    "lower fullness": np.array([(0, -65.4, 102.0), (5.0, -65.4, 101.5), (10.5, -64.7, 99.3), (16, -63.4, 95.3), (20.5, -62.3, 90.6), (24.6, -61.1, 86.0)]),
    "lower border": np.array([(0, -70.3, 96.8), (5.0, -70.1, 96.4), (10.5, -68.9, 94.9), (16, -66.3, 92.1), (20.5, -63.6, 89.2), (24.6, -61.3, 86.4)]),
}  # fmt: skip

NOSTRIL = np.array([6.9, -40.0, 101.6])

BROW = np.array([(12.5, 15.8), (19, 17.6), (28, 19.6), (37, 21.0), (45, 19.9), (52.5, 15.8)])


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
