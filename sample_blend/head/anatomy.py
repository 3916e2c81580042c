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
        (0, -45.5, 100.5), (12, -46, 98.2), (22, -49, 91.5), (30, -50, 84.5), (40, -52, 73.5), (50, -54, 54), (57, -54, 30), (59, -54, 10),
        (31, -62, 81.5), (40, -67, 66), (48, -66, 45), (53, -66, 18), (49, -74, 10),
        (15, -76, 88.5), (27, -76, 79), (37, -78, 63), (45, -75, 40),
        (10, -91, 91.7), (20, -90, 84), (30, -88, 69), (38, -84.5, 50), (44, -80, 32),
        (10, -101.5, 82), (20, -98.5, 72), (28, -95, 58),
        (15, -105, 60), (25, -100.5, 45), (20, -106, 38), (38, -92, 20),
        # neck
        (52, -100, -15), (51, -125, -18), (50, -98, -35), (36, -120, 11), (38, -120, -52),
        # skull
        (73.5, 45, -10), (72, 15, -30), (66, 60, -45), (45, 60, -75), (60, 20, -65), (55, 90, 0), (40, 95, 40), (40, 95, -50),
        (58, -20, -50), (56, -50, -40),
    ],
    dtype=float,
)  # fmt: skip

# Lid margins in the frontal plane: inner canthus, over the top to the outer canthus; and along the bottom.
CANTHUS_INNER = np.array([16.6, -1.8, 72.5])
CANTHUS_OUTER = np.array([44.6, 1.2, 67.0])
LID_UPPER = np.array(
    [(16.6, -1.8), (19.0, 0.6), (22.5, 3.2), (27.0, 4.7), (31.5, 5.1), (36.0, 4.8), (40.5, 3.5), (44.6, 1.2)]
)
LID_LOWER = np.array(
    [(16.6, -1.8), (19.5, -2.7), (24.0, -4.4), (29.0, -5.6), (34.0, -5.7), (38.5, -4.5), (42.0, -2.0), (44.6, 1.2)]
)
CREASE = np.array(
    [(17.5, 4.4), (21.0, 7.6), (26.0, 9.9), (31.5, 10.7), (37.0, 10.4), (42.0, 8.6), (46.5, 5.4), (49.0, 2.6)]
)

# Lips from the midline to the corner (x, y, z): five rails from the upper vermilion border to the lower.
LIP_RAILS = {
    "upper border": np.array([(0, -53.2, 102.6), (5.3, -51.6, 102.3), (10.5, -53.3, 100.4), (16, -55.9, 96.6), (21, -58.2, 91.8), (25.2, -60.2, 87.2)]),
    "upper fullness": np.array([(0, -57.2, 105.6), (5.3, -56.2, 104.8), (10.5, -56.8, 102.5), (16, -58.0, 98.6), (21, -59.4, 93.0), (25.2, -60.3, 87.1)]),
    "upper wet": np.array([(0, -60.2, 103.6), (5.3, -59.5, 103.0), (10.5, -59.4, 100.6), (16, -59.9, 96.9), (21, -60.3, 91.7), (25.2, -60.4, 86.8)]),
    "lower wet": np.array([(0, -61.4, 102.4), (5.3, -60.9, 101.8), (10.5, -60.6, 99.6), (16, -60.7, 96.0), (21, -60.7, 91.2), (25.2, -60.5, 86.8)]),
    "lower fullness": np.array([(0, -65.2, 104.0), (5.3, -65.2, 103.4), (10.5, -64.6, 101.2), (16, -63.2, 97.2), (21, -61.9, 92.0), (25.2, -60.6, 87.1)]),
    "lower border": np.array([(0, -70.2, 98.4), (5.3, -70.0, 98.0), (10.5, -68.7, 96.4), (16, -66.0, 93.6), (21, -63.0, 90.3), (25.2, -60.8, 87.2)]),
}  # fmt: skip

NOSTRIL = np.array([7.2, -42.3, 99.5])
EAR = np.array([70.0, -10.0, -8.0])
