"""Finished assets for Unity, and the ``.meta`` of each, so that nothing is left to set by hand."""

from collections.abc import Iterator
from typing import NamedTuple

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile, Role
from fire_atlas.engines.unity.flake_tracks import AnimationFlakes, flake_bytes
from fire_atlas.engines.unity.geometry import max_texture_size, pivot_px
from fire_atlas.engines.unity.identity import guid_of, guids_in, part_id
from fire_atlas.engines.unity.meta import (
    SECONDARY,
    TEXTURE_KEYS,
    merged,
    read_meta,
    with_max_size,
)
from fire_atlas.engines.unity.names import file_stems, player_name, state_names
from fire_atlas.engines.unity.sprites import SpriteOfPage, sprites_of
from fire_atlas.engines.unity.yaml_text import scalar, single
from fire_atlas.formats.product import Product
from fire_atlas.formats.templates.jinja import rendered
from fire_atlas.recipe.output import UnityOptions

_FILTERS = (scalar, single)

_DEFAULT_SPRITE_MATERIAL = "{fileID: 10754, guid: 0000000000000000f000000000000000, type: 0}"
"""Unity's own: for straight alpha."""


class _Kind(NamedTuple):
    """What imports a kind of file, and the id of the main thing in it."""

    importer: str
    main_id: int = 0


_KINDS = {
    ".anim": _Kind("NativeFormatImporter", 7400000),
    ".controller": _Kind("NativeFormatImporter", 9100000),
    ".mat": _Kind("NativeFormatImporter", 2100000),
    ".prefab": _Kind("PrefabImporter"),
    ".shader": _Kind("ShaderImporter"),
    ".cs": _Kind("MonoImporter"),
    ".bytes": _Kind("TextScriptImporter"),
    ".asmdef": _Kind("AssemblyDefinitionImporter"),
}
"""By the ending of the file's name."""


def export_unity(product: Product, options: UnityOptions) -> Iterator[OutputFile]:
    """Yield all that Unity needs to play the product; see ``docs/engines/unity.md``.

    Raises:
        OutputError: Two names cannot be told apart in Unity, or a ``.meta`` cannot be kept.
    """
    yield from _Export(product, options).files()


class _Export:
    """One export: what all its files have in common."""

    def __init__(self, product: Product, options: UnityOptions) -> None:
        self.product = product
        self.options = options
        self.name = product.name
        self.states = state_names([each.name for each in product.sheets[0].animations])
        self.player = f"{player_name(self.name)}.cs"

    def files(self) -> Iterator[OutputFile]:
        """Yield every file: shaders and scripts first, what refers to them after."""
        if self.product.sheets[0].alpha != "straight":
            yield from self.shader(self.name, "sprite.shader.j2")
        if self.plays_flakes:
            yield from self.flakes()
        for sheet in self.product.sheets:
            yield from self.effect(sheet)

    @property
    def plays_flakes(self) -> bool:
        """Whether there are flakes for the player, and it is wanted."""
        return bool(self.product.tracks) and self.options.flakes

    def guid(self, file: str) -> str:
        """Return the GUID of an output: that which it has already, or one made from its name."""
        meta = f"{file}.meta"
        old = read_meta(meta, self.product.existing(meta))
        return guids_in(old)[0] if old else guid_of(self.options.namespace, file)

    def asset(self, file: str, data: bytes, role: Role = "engine") -> Iterator[OutputFile]:
        """Yield a file and its ``.meta``."""
        kind = _KINDS[file[file.rindex(".") :]]
        yield OutputFile(file, role, data)
        fresh = rendered(
            "unity/asset.meta.j2",
            guid=self.guid(file),
            importer=kind.importer,
            main_id=kind.main_id,
        )
        old = read_meta(f"{file}.meta", self.product.existing(f"{file}.meta"))
        yield OutputFile(f"{file}.meta", "import", merged(old, fresh, ()).encode())

    def text(self, file: str, template: str, **context: object) -> Iterator[OutputFile]:
        """Yield what a template makes, and its ``.meta``."""
        stem = file[: file.rindex(".")]
        context = {"name": stem, "namespace": self.options.namespace, **context}
        yield from self.asset(file, rendered(f"unity/{template}", _FILTERS, **context).encode())

    def shader(
        self, stem: str, template: str, floats: tuple[str, ...] = ()
    ) -> Iterator[OutputFile]:
        """Yield a shader and a material of it, ``floats`` of which are 0.

        The material is its owner's once it is there.
        """
        yield from self.text(f"{stem}.shader", template, name=self.name)
        material = (
            self.product.existing(f"{stem}.mat")
            or rendered(
                "unity/material.mat.j2",
                _FILTERS,
                name=stem,
                shader=self.guid(f"{stem}.shader"),
                floats=floats,
            ).encode()
        )
        yield from self.asset(f"{stem}.mat", material, "import")

    def flakes(self) -> Iterator[OutputFile]:
        """Yield the flakes' tracks and what plays them."""
        class_name = self.player.removesuffix(".cs")
        yield from self.text(self.player, "player.cs.j2", name=self.name, **{"class": class_name})
        if self.options.assembly:
            yield from self.text(f"{self.options.namespace}.asmdef", "assembly.asmdef.j2")
        yield from self.shader(f"{self.name}.flakes", "flakes.shader.j2", ("_Hdr",))
        yield from self.asset(f"{self.name}.flakes.bytes", flake_bytes(self.flakes_by_animation()))

    def flakes_by_animation(self) -> Iterator[AnimationFlakes]:
        """Yield the flakes of each animation."""
        sheet = self.product.sheets[0]
        first = {each.name: each.frames[0] for each in sheet.animations}
        pivots = {region.name: pivot_px(region) for region in sheet.regions}
        for animation, tracks in self.product.tracks.items():
            yield AnimationFlakes(self.states[animation], pivots[first[animation]], tracks)

    def effect(self, sheet: AtlasSheet) -> Iterator[OutputFile]:
        """Yield the pages' ``.meta``, animations, controller and prefab of one scale."""
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
        sprites: dict[str, SpriteOfPage],
        *,
        data: bool = False,
    ) -> OutputFile:
        """Return the ``.meta`` of a page or of a layer, which cuts it into sprites.

        Motion vectors are ``data``: no colours, no sprites, and nothing may compress them.
        """
        page, file = sheet.pages[index], f"{image}.meta"
        size = max_texture_size(page.width, page.height)
        moving = [each.files[index] for each in sheet.maps if each.kind == "motion"]
        beside = moving if image == page.file else []
        fresh = rendered(
            "unity/texture.meta.j2",
            _FILTERS,
            guid=self.guid(image),
            sprites=[] if data else [sprites[region.name] for region in sheet.regions_of(index)],
            alpha=sheet.alpha,
            data=data,
            secondary=[{"guid": self.guid(each), "name": "_MotionTex"} for each in beside],
            max_size=size,
            pixels_per_unit=self.options.pixels_per_unit * sheet.scale,
        )
        old = read_meta(file, self.product.existing(file))
        owned = (*TEXTURE_KEYS, *((SECONDARY,) if beside else ()))
        meta = with_max_size(merged(old, fresh, owned), size)
        return OutputFile(file, "import", meta.encode())

    def clips(self, sheet: AtlasSheet, sprites: dict[str, SpriteOfPage]) -> Iterator[OutputFile]:
        """Yield an animation clip for each animation, and the controller of them."""
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
            states.append({"name": state, "id": part_id("state", state), "clip": self.guid(file)})
        yield from self.text(f"{sheet.name}.controller", "animator.controller.j2", states=states)

    def prefab(self, sheet: AtlasSheet, sprites: dict[str, SpriteOfPage]) -> Iterator[OutputFile]:
        """Yield what is dragged into a scene."""
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
            f"{sheet.name}.prefab",
            "effect.prefab.j2",
            sprite=first,
            size=(first.rect.width / units, first.rect.height / units),
            material=_DEFAULT_SPRITE_MATERIAL if sheet.alpha == "straight" else material,
            controller=self.guid(f"{sheet.name}.controller"),
            player=player if self.plays_flakes else None,
        )
