"""Projection onto divergence-free fields (the −∇P of eq. 12)."""

import numpy as np

from fire_atlas.core.pixels import Plane, as_plane


def project(u: Plane, v: Plane) -> tuple[Plane, Plane]:
    """Remove the divergence of a field (rows, columns), spectrally.

    The field is continued by its mirror image at every border (u odd in x, v odd in y), so that the
    periodic transform sees closed walls instead of the opposite side.
    """
    rows, columns = u.shape
    wide = np.block([[u, -u[:, ::-1]], [u[::-1], -u[::-1, ::-1]]])
    tall = np.block([[v, v[:, ::-1]], [-v[::-1], -v[::-1, ::-1]]])
    su, sv = np.fft.rfft2(wide), np.fft.rfft2(tall)
    kx = np.fft.rfftfreq(2 * columns)[None].astype(np.float32)
    ky = np.fft.fftfreq(2 * rows)[:, None].astype(np.float32)
    square = kx**2 + ky**2
    square[0, 0] = 1.0
    along = (su * kx + sv * ky) / square
    shape = wide.shape
    free_u = np.fft.irfft2(su - along * kx, s=shape)[:rows, :columns]
    free_v = np.fft.irfft2(sv - along * ky, s=shape)[:rows, :columns]
    return as_plane(free_u), as_plane(free_v)
