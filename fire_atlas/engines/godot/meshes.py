"""Frames' meshes as Godot stores them: surfaces of vertices with their places on a page."""

from dataclasses import dataclass

import numpy as np

from fire_atlas.atlas.sheet import Mesh, Page
from fire_atlas.engines.godot.sprite_frames import AtlasTexture, FrameBounds

SURFACE_FORMAT = 1 | 1 << 4 | 1 << 12 | 1 << 25 | 1 << 35
"""Godot's flags of a surface: it has vertices, texture coordinates and indices, its vertices are
two-dimensional, and its format is the second, of Godot 4.2."""


@dataclass(frozen=True, slots=True)
class MeshSurface:
    """A mesh as the surface of Godot's ``ArrayMesh``.

    Attributes:
        size: Width and height of the box that the texture stands for, px.
        reach: x, y, width, height that the engine takes for the mesh's own, px: see ``_reach``.
        vertex_count, index_count: Numbers of vertices, and of corners of triangles.
        vertices: Bytes of the vertices' places in the box, px.
        uvs: Bytes of their places on the page, 0..1.
        indices: Bytes of the triangles' corners.
    """

    size: tuple[float, float]
    reach: tuple[float, float, float, float]
    vertex_count: int
    index_count: int
    vertices: bytes
    uvs: bytes
    indices: bytes


def surface_of(texture: AtlasTexture, mesh: Mesh, page: Page, box: FrameBounds) -> MeshSurface:
    """Return the surface that draws a texture as its mesh; ``box`` is that of all frames."""
    points = np.array(mesh.vertices, np.float64)
    places = points + np.array((texture.margin.left, texture.margin.top))
    uvs = (points + np.array((texture.x, texture.y))) / (page.width, page.height)
    indices = np.array(mesh.triangles, "<u2")
    return MeshSurface(
        size=(box.width, box.height),
        reach=_reach(box),
        vertex_count=len(points),
        index_count=indices.size,
        vertices=places.astype("<f4").tobytes(),
        uvs=uvs.astype("<f4").tobytes(),
        indices=indices.tobytes(),
    )


def _reach(box: FrameBounds) -> tuple[float, float, float, float]:
    """Return the bounds by which the engine decides whether a mesh can be seen: all that a sprite
    may draw with the scene's offset, without any, or centred.

    The engine compares the bounds of the mesh itself with the screen, as if a sprite had no offset.
    """
    left, top = min(box.x, -box.width / 2), min(box.y, -box.height / 2)
    right, bottom = max(box.x, 0) + box.width, max(box.y, 0) + box.height
    return left, top, right - left, bottom - top
