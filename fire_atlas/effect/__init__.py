"""Simulate the fire-flakes (sparks) of a clip, after Kim & Lee 2019.

The modules that compute the equations of "Fire Sprite Animation Using Fire-Flake Texture and
Artificial Motion Blur":

================  =========================  ==================================================
eq. 1-3, κ        ``flame.features``         edges, feature vectors Fv and Fv*
ε, α              ``flame.study``            thresholds, decided once for the whole clip
U_buoyancy        ``field.forcing``          body force of a frame: its optical flow and Fv*
eq. 12            ``field.buoyancy``         buoyancy field Bv (eq. 4-11 derive it)
‖Fv*‖ > α         ``flakes.emission``        candidates C_pos, and how many flakes they shed
eq. 13            ``flakes.flight``          flakes follow Bv with inertia and jitter
eq. 17, Figure 9  ``flakes.appearance``      streaks and colours of flakes
eq. 14-17         ``composition.blur``       motion blur of the flame along Bv κ
================  =========================  ==================================================
"""
