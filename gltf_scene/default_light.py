"""The light and the background of scenes without lights of their own, for both back ends.

A sky whose radiance changes evenly with the height of the direction, and a key light over the
viewer's shoulder (`Camera.light_direction`). shaders/scene/default_light.glsl has the same numbers.
"""

from __future__ import annotations

import numpy as np

# Light that a white diffuse surface reflects (radiance, linear RGB): facing up, facing down, and
# facing the key light alone.
SKY = (0.26, 0.29, 0.34)
GROUND = (0.15, 0.13, 0.12)
KEY = (0.58, 0.56, 0.52)


def sky_radiance(directions: np.ndarray) -> np.ndarray:
    """Return float64[..., 3] radiance from unit directions, float[..., 3]; y is up.

    Radiance a + b y makes a diffuse surface with normal n reflect a + 2/3 b n.y.
    """
    mean, change = np.add(SKY, GROUND) / 2, np.subtract(SKY, GROUND) / 2
    return mean + 1.5 * change * np.asarray(directions, np.float64)[..., 1:2]
