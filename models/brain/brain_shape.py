"""The brain phantom's surface as the zero level of `shape`, negative inside. Millimetres.

Parts: two ellipsoidal hemispheres, temporal lobes, a stem, a cerebellum, a flat base. A longitudinal fissure cuts from
above. Sulci follow the zero lines of a seeded, band-limited random field.
"""

import numpy as np

SULCUS_DEPTH = 6.5      # mm
SULCUS_WIDTH = 6.0      # mm, half width at 1/e of the depth


def smooth_min(a, b, k):
    """Minimum with a blend of width k: a smooth union."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def smooth_max(a, b, k):
    return -smooth_min(-a, -b, k)


def ellipsoid(p, centre, semi):
    """First-order distance to an ellipsoid, negative inside."""
    q = (p - centre) / semi
    k0 = np.linalg.norm(q, axis=1)
    k1 = np.linalg.norm(q / semi, axis=1)
    return k0 * (k0 - 1) / np.maximum(k1, 1e-9)


_random = np.random.RandomState(7)
_WAVES = _random.normal(size=(24, 3))
_WAVES *= (2 * np.pi / _random.uniform(44, 58, 24) / np.linalg.norm(_WAVES, axis=1))[:, None]
_PHASES = _random.uniform(0, 2 * np.pi, 24)


def folds(p):
    """Depth of the sulci, mm: troughs along the zero lines of a random field of wavelength about 50 mm.

    The field is read at the point's central projection onto an ellipsoid, so a sulcus goes straight down and never
    undercuts the surface.
    """
    q = (p - (0.0, 0.0, 45.0)) / (71.0, 86.0, 62.0)
    q = q / np.maximum(np.linalg.norm(q, axis=1), 1e-6)[:, None] * (71.0, 86.0, 62.0)
    angle = q @ _WAVES.T + _PHASES
    slope = np.linalg.norm(np.sin(angle) @ _WAVES, axis=1)
    distance = np.cos(angle).sum(axis=1) / np.maximum(slope, 0.15)  # mm, to first order, to the nearest zero line
    return SULCUS_DEPTH * np.exp(-(distance / SULCUS_WIDTH) ** 2)


def shape(p):
    side = np.abs(p[:, 0])
    m = np.column_stack([side, p[:, 1], p[:, 2]])
    # Narrower at the front: scale x by a factor of y.
    m[:, 0] = side / (1 - 0.0016 * p[:, 1] - 0.000008 * p[:, 1] ** 2)
    cerebrum = ellipsoid(m, (22.0, 0.0, 54.0), (50.0, 86.0, 57.0))
    temporal = ellipsoid(m, (44.0, 16.0, 24.0), (23.0, 42.0, 20.0))
    # Under the cerebrum the front and the back rise; the temporal lobe hangs below, parted by the lateral fissure.
    floor = 20 + 0.0022 * p[:, 1] ** 2 - p[:, 2]
    cerebrum = smooth_max(cerebrum, floor, 16)
    f = smooth_min(cerebrum, temporal, 3)
    # The lateral (Sylvian) fissure: a groove rising backwards on the flank.
    lateral = p[:, 2] - (40 - 0.30 * (p[:, 1] - 16))
    reach = 1 / (1 + np.exp(-(side - 44) / 3)) / (1 + np.exp(-(p[:, 1] + 24) / 4))
    f = f + 8.0 * np.exp(-(lateral / 5.5) ** 2) * reach
    on_cortex = 1 / (1 + np.exp(-(p[:, 2] - 22) / 5))
    f = f + folds(p) * on_cortex
    # The longitudinal fissure: a slot whose floor is highest in the middle.
    bottom = 62 - 0.0052 * p[:, 1] ** 2
    half_gap = 3.0 + 0.035 * np.maximum(p[:, 2] - bottom, 0)
    slot = smooth_max(side - half_gap, bottom - p[:, 2], 5)
    f = smooth_max(f, -slot, 6)
    # Brain stem and cerebellum, then the flat base.
    f = smooth_min(f, ellipsoid(m, (17.0, -50.0, 18.0), (28.0, 26.0, 19.0)), 3)
    f = smooth_min(f, ellipsoid(m, (0.0, -14.0, 18.0), (20.0, 24.0, 40.0)), 6)
    return smooth_max(f, -p[:, 2], 5)


def gradient(p, step=0.05):
    g = np.empty_like(p)
    for axis in range(3):
        e = np.zeros(3)
        e[axis] = step
        g[:, axis] = (shape(p + e) - shape(p - e)) / (2 * step)
    return g


def project(p, rounds=6):
    """Moves points to the zero level along the gradient, at most 1.5 mm a round."""
    p = np.array(p, float)
    for _ in range(rounds):
        f, g = shape(p), gradient(p)
        move = -(f / np.maximum((g * g).sum(axis=1), 0.05))[:, None] * g
        length = np.linalg.norm(move, axis=1)
        p += move * np.minimum(1, 1.5 / np.maximum(length, 1e-12))[:, None]
    return p
