"""The fire status state machine (Lee et al., III-B, Figure 7): which leaning set is drawn when.

The force on a fire is the wind's and, in still air, the fire's own: it leans as its clip did. The
force gives a lean, the lean one of six states; the set of that state is *swing* while the force
changes and *rest* while it is sustained. The frames drawn come from the set that is selected.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.profile.generate.playback import Reference
from fire_atlas.generators.profile.generate.wind_response import WindResponse
from fire_atlas.generators.profile.model import STATE_EDGES, Side, leaning_state, swinging

_SUSTAINED = 0.6
"""Steadiness of the wind above which its force counts as sustained."""

_FULL_FORCE = 1.0
"""Level of wind from which on the wind alone decides the lean, not the fire's own."""

_SLOW_TIME = 0.2
"""Standard deviation, seconds, of the smoothing of the fire's own lean when a wind blows."""


@dataclass(frozen=True, slots=True)
class SelectedStates:
    """What the state machine asks for in every frame of a fire, in one vertical plane.

    Attributes:
        lean: (frames,) lean that decides the state, degrees.
        wind_lean: (frames,) the lean that the force alone gives, degrees, within ±30.
        force: (frames,) 0 in still air, 1 where the wind alone decides.
        sets: (frames,) index of the leaning set: twice the state, plus 1 for ``rest``.
    """

    lean: NDArray[np.float64]
    wind_lean: NDArray[np.float64]
    force: NDArray[np.float64]
    sets: NDArray[np.intp]

    @classmethod
    def of(
        cls, side: Side, wind: WindResponse, azimuth: float, reference: Reference, fps: float
    ) -> "SelectedStates":
        """Run the state machine.

        Args:
            side: The clip that is shown in this plane.
            wind: Response to the wind.
            azimuth: Direction of the plane, radians.
            reference: How the clip is played in still air.
            fps: Frames of the fire per second.
        """
        frames = len(reference.positions)
        leans, median = np.array(side.leans), side.statistics.lean.median
        shown = reference.positions.astype(np.intp)
        own = leans[shown] - median
        mode = "wrap" if reference.loop else "nearest"
        slow = gaussian_filter1d(own, _SLOW_TIME * fps, mode=mode)
        force = smooth_step(np.hypot(*wind.level.T) / _FULL_FORCE)
        gain = np.array([wind.sway_gain(i) for i in range(frames)])
        # The clip's own lean gives way to that of the wind.
        blown = (1 - force) * median + np.array([wind.lean(i, azimuth) for i in range(frames)])
        driven = blown + gain * slow
        lean = (1 - force) * (blown + own) + force * driven
        rests = np.where(force > 0.5, wind.steadiness > _SUSTAINED, ~swinging(leans)[shown])
        states = np.array([leaning_state(degrees) for degrees in lean])
        return cls(
            lean, np.clip(driven, STATE_EDGES[0], STATE_EDGES[-1]), force, 2 * states + rests
        )
