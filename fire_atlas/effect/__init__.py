"""Fire-flakes that fly with a clip: "Fire Sprite Animation Using Fire-Flake Texture and Artificial
Motion Blur" (Kim & Lee 2019). Where its equations are:

=================  ==========================  ===============================================
eq. 1-3            ``flame.features``          edges, feature vectors Fv and Fv*, κ
ε, α               ``flame.study``             thresholds, decided once for the whole clip
eq. 12 (4-11 →)    ``field.buoyancy``          buoyancy field Bv; ``field.forcing``: U_buoyancy
‖Fv*‖ > α          ``flakes.emission``         candidates C_pos and how many flakes they shed
eq. 13             ``flakes.flight``           flakes follow Bv with inertia and jitter
eq. 14-17          ``composition.blur``        motion blur of the flame along Bv κ
eq. 17, Figure 9   ``flakes.appearance``       streaks and colours of flakes
=================  ==========================  ===============================================
"""
