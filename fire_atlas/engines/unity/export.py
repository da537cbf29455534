"""Export a build to Unity: assets with their ``.meta``, so that nothing has to be set by hand."""

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile, Role
from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH
from fire_atlas.engines.unity.flake_tracks import AnimationFlakes, flake_bytes
from fire_atlas.engines.unity.meta import (
    SECONDARY_TEXTURES,
    TEXTURE_KEYS,
    merged,
    read_meta,
    with_max_size,
)
from fire_atlas.engines.unity.names import (
    CONTROLLER_ENDING,
    META_ENDING,
    PREFAB_ENDING,
    file_stems,
    guid_of,
    guids_in,
    local_file_id,
    player_name,
    state_names,
)
from fire_atlas.engines.unity.sprites import PageSprite, max_texture_size, pivot_px, sprites_of
from fire_atlas.formats.product import Product
from fire_atlas.formats.templates.jinja import rendered
from fire_atlas.recipe.output import UnityOptions

_DEFAULT_SPRITE_MATERIAL = "{fileID: 10754, guid: 0000000000000000f000000000000000, type: 0}"
"""Unity's own material, for straight alpha."""

_PLAIN_SCALAR = re.compile(r"[A-Za-z_][\w./@+-]*( [\w./@+-]+)*", re.ASCII)
"""Text that needs no quotes in YAML."""

_ESCAPED = {'"': '\\"', "\\": "\\\\"}

_EXPOSED = 6
"""Value of a flake material's ``_Light``: flakes are shown as film shows them."""


class _AssetType(NamedTuple):
    """Unity's importer of a type of file, and the local id of its main object."""

    importer: str
    main_id: int = 0


_ASSET_TYPES = {
    ".anim": _AssetType("NativeFormatImporter", 7400000),
    CONTROLLER_ENDING: _AssetType("NativeFormatImporter", 9100000),
    ".mat": _AssetType("NativeFormatImporter", 2100000),
    PREFAB_ENDING: _AssetType("PrefabImporter"),
    ".shader": _AssetType("ShaderImporter"),
    ".cs": _AssetType("MonoImporter"),
    ".bytes": _AssetType("TextScriptImporter"),
    ".asmdef": _AssetType("AssemblyDefinitionImporter"),
}
"""Asset types by the ending of the file name."""


def export_unity(product: Product, options: UnityOptions) -> Iterator[OutputFile]:
    """Yield all assets with their ``.meta``; see ``docs/engines/unity.md``.

    Raises:
        OutputError: Two names would be the same in Unity, or a ``.meta`` cannot be kept.
    """
    yield from _Export(product, options).files()


class _Export:
    """One export: the product, options and names from which all of its files are made."""

    def __init__(self, product: Product, options: UnityOptions) -> None:
        self.product = product
        self.options = options
        self.name = product.name
        self.states = state_names([each.name for each in product.sheets[0].animations])
        self.player = f"{player_name(self.name)}.cs"

    def files(self) -> Iterator[OutputFile]:
        """Yield every file: shaders and scripts first, then what refers to them."""
        if self.product.sheets[0].alpha != "straight":
            yield from self.shader(self.name, "sprite.shader.j2")
        if self.plays_flakes:
            yield from self.flakes()
        for sheet in self.product.sheets:
            yield from self.effect(sheet)

    @property
    def plays_flakes(self) -> bool:
        """Whether the prefab plays flakes: there are some, and the options allow it."""
        return bool(self.product.tracks) and self.options.flakes

    def guid(self, file: str) -> str:
        """Return the GUID of an output: its existing one, or one derived from its name."""
        meta = file + META_ENDING
        old = read_meta(meta, self.product.existing(meta))
        return guids_in(old)[0] if old else guid_of(self.options.namespace, file)

    def asset(self, file: str, data: bytes, role: Role = "engine") -> Iterator[OutputFile]:
        """Yield a file and its ``.meta``."""
        meta = file + META_ENDING
        asset_type = _ASSET_TYPES[file[file.rindex(".") :]]
        yield OutputFile(file, role, data)
        fresh = rendered(
            "unity/asset.meta.j2",
            guid=self.guid(file),
            importer=asset_type.importer,
            main_id=asset_type.main_id,
        )
        old = read_meta(meta, self.product.existing(meta))
        yield OutputFile(meta, "import", merged(old, fresh, ()).encode())

    def text(self, file: str, template: str, **context: object) -> Iterator[OutputFile]:
        """Yield a file rendered from a template, and its ``.meta``."""
        stem = file[: file.rindex(".")]
        context = {
            "name": stem,
            "namespace": self.options.namespace,
            "halo_light": HALO_LIGHT,
            "halo_width": HALO_WIDTH,
            **context,
        }
        yield from self.asset(
            file, rendered(f"unity/{template}", (scalar, single), **context).encode()
        )

    def shader(
        self, stem: str, template: str, floats: Mapping[str, int] | None = None
    ) -> Iterator[OutputFile]:
        """Yield a shader and its material, which sets the float properties ``floats``.

        An existing material is kept: the user may have changed it.
        """
        yield from self.text(f"{stem}.shader", template, name=self.name)
        material = (
            self.product.existing(f"{stem}.mat")
            or rendered(
                "unity/material.mat.j2",
                (scalar, single),
                name=stem,
                shader=self.guid(f"{stem}.shader"),
                floats=floats or {},
            ).encode()
        )
        yield from self.asset(f"{stem}.mat", material, "import")

    def flakes(self) -> Iterator[OutputFile]:
        """Yield the tracks of the flakes, and the script and shader that play them."""
        class_name = self.player.removesuffix(".cs")
        yield from self.text(self.player, "player.cs.j2", name=self.name, **{"class": class_name})
        if self.options.assembly:
            yield from self.text(f"{self.options.namespace}.asmdef", "assembly.asmdef.j2")
        yield from self.shader(f"{self.name}.flakes", "flakes.shader.j2", {"_Light": _EXPOSED})
        yield from self.asset(f"{self.name}.flakes.bytes", flake_bytes(self.flakes_by_animation()))

    def flakes_by_animation(self) -> Iterator[AnimationFlakes]:
        """Yield the flakes of each animation."""
        sheet = self.product.sheets[0]
        first = {each.name: each.frames[0] for each in sheet.animations}
        pivots = {region.name: pivot_px(region) for region in sheet.regions}
        for animation, tracks in self.product.tracks.items():
            yield AnimationFlakes(self.states[animation], pivots[first[animation]], tracks)

    def effect(self, sheet: AtlasSheet) -> Iterator[OutputFile]:
        """Yield the files of one scale: ``.meta`` of pages, animations, controller and prefab."""
        sprites = sprites_of(sheet, self.guid)
        for i, page in enumerate(sheet.pages):
            yield self.page_meta(sheet, i, page.file, sprites)
            for each in sheet.maps:
                yield self.page_meta(sheet, i, each.files[i], sprites, data=each.kind == "motion")
        yield from self.clips(sheet, sprites)
        yield from self.prefab(sheet, sprites)

    def page_meta(
        self,
        sheet: AtlasSheet,
        index: int,
        image: str,
        sprites: dict[str, PageSprite],
        *,
        data: bool = False,
    ) -> OutputFile:
        """Return the ``.meta`` that cuts the image of a page or map into sprites.

        ``data`` is for motion vectors, imported without colour space, sprites or compression.
        """
        page, file = sheet.pages[index], image + META_ENDING
        size = max_texture_size(page.width, page.height)
        vectors = [each.files[index] for each in sheet.maps if each.kind == "motion"]
        secondary = vectors if image == page.file else []
        fresh = rendered(
            "unity/texture.meta.j2",
            (scalar, single),
            guid=self.guid(image),
            sprites=[] if data else [sprites[region.name] for region in sheet.regions_of(index)],
            alpha=sheet.alpha,
            data=data,
            secondary=[{"guid": self.guid(each), "name": "_MotionTex"} for each in secondary],
            max_size=size,
            pixels_per_unit=self.options.pixels_per_unit * sheet.scale,
        )
        old = read_meta(file, self.product.existing(file))
        owned = (*TEXTURE_KEYS, *((SECONDARY_TEXTURES,) if secondary else ()))
        meta = with_max_size(merged(old, fresh, owned), size)
        return OutputFile(file, "import", meta.encode())

    def clips(self, sheet: AtlasSheet, sprites: dict[str, PageSprite]) -> Iterator[OutputFile]:
        """Yield an animation clip for each animation, and the controller that plays them."""
        duration = {region.name: region.duration for region in sheet.regions}
        stems = file_stems(sheet.title, [each.name for each in sheet.animations])
        states = []
        for animation in sheet.animations:
            file = f"{sheet.name}{stems[animation.name].removeprefix(sheet.title)}.anim"
            fps = 1000 / duration[animation.frames[0]]
            keys = [
                {"time": i / fps, "sprite": sprites[frame]}
                for i, frame in enumerate(animation.frames)
            ]
            yield from self.text(file, "clip.anim.j2", keys=keys, fps=fps, loop=animation.loop)
            state = self.states[animation.name]
            states.append(
                {"name": state, "id": local_file_id("state", state), "clip": self.guid(file)}
            )
        yield from self.text(
            sheet.name + CONTROLLER_ENDING, "animator.controller.j2", states=states
        )

    def prefab(self, sheet: AtlasSheet, sprites: dict[str, PageSprite]) -> Iterator[OutputFile]:
        """Yield the prefab of one scale, which a user drags into a scene."""
        first = sprites[sheet.animations[0].frames[0]]
        units = self.options.pixels_per_unit * sheet.scale
        material = f"{{fileID: 2100000, guid: {self.guid(f'{self.name}.mat')}, type: 2}}"
        player = {
            "script": self.guid(self.player),
            "material": self.guid(f"{self.name}.flakes.mat"),
            "tracks": self.guid(f"{self.name}.flakes.bytes"),
            "pixels_per_unit": self.options.pixels_per_unit,
            "baked": bool(self.product.baked),
        }
        yield from self.text(
            sheet.name + PREFAB_ENDING,
            "effect.prefab.j2",
            sprite=first,
            size=(first.rect.width / units, first.rect.height / units),
            material=_DEFAULT_SPRITE_MATERIAL if sheet.alpha == "straight" else material,
            controller=self.guid(sheet.name + CONTROLLER_ENDING),
            player=player if self.plays_flakes else None,
        )


def scalar(text: str) -> str:
    """Return text as a YAML scalar in one line: plain, or quoted in ASCII."""
    if _PLAIN_SCALAR.fullmatch(text):
        return text
    return f'"{"".join(map(_escaped, text))}"'


def single(value: float) -> str:
    """Return the shortest text from which float32 reads the same number."""
    return np.format_float_positional(np.float32(value), trim="-")


def _escaped(character: str) -> str:
    code = ord(character)
    if 32 <= code < 127:
        return _ESCAPED.get(character, character)
    return f"\\u{code:04X}" if code < 0x10000 else f"\\U{code:08X}"
