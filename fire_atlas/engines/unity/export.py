"""Export a build to Unity: assets with their ``.meta``, so that nothing has to be set by hand."""

import re
from collections.abc import Iterator, Mapping

from fire_atlas.atlas.sheet import CHANNELS, RAMP_WIDTH, AtlasSheet, Heat
from fire_atlas.core.output_file import OutputFile, Role
from fire_atlas.engines.unity.assets import (
    ComponentNames,
    assembly_text,
    heat_player_text,
    meta_text,
    player_text,
    scalar,
    shader_text,
    single,
    start_text,
)
from fire_atlas.engines.unity.flake_tracks import AnimationFlakes, flake_bytes
from fire_atlas.engines.unity.meta import (
    MESH_TYPE,
    SECONDARY_TEXTURES,
    TEXTURE_KEYS,
    merged,
    read_meta,
    with_max_size,
)
from fire_atlas.engines.unity.names import (
    ASSEMBLY_ENDING,
    CLIP_ENDING,
    CONTROLLER_ENDING,
    MATERIAL_ENDING,
    META_ENDING,
    PREFAB_ENDING,
    SCRIPT_ENDING,
    SHADER_ENDING,
    TABLE_ENDING,
    Played,
    file_stems,
    guid_of,
    guids_in,
    local_file_id,
    player_name,
    state_names,
)
from fire_atlas.engines.unity.package import (
    FLAKES,
    FLAKES_SHADER,
    HEAT,
    HEAT_SHADER,
    PLAYER,
    SPRITE_SHADER,
    package_guid,
    shader_template,
)
from fire_atlas.engines.unity.sprites import PageSprite, max_texture_size, pivot_px, sprites_of
from fire_atlas.engines.unity.states import (
    BURNING,
    AnimatorState,
    animator_states,
    first_of_variants,
)
from fire_atlas.formats.output_names import light_file
from fire_atlas.formats.product import Product
from fire_atlas.formats.templates.jinja import rendered
from fire_atlas.recipe.output import UnityOptions

_DEFAULT_SPRITE_MATERIAL = "{fileID: 10754, guid: 0000000000000000f000000000000000, type: 0}"
"""Unity's own material, for straight alpha."""

_LAMP_RANGE, _LAMP_DEPTH = 4, 0.25
"""Range of the lamp of a new prefab, and how far before the sprite it is: in heights of a frame."""

_SECONDARY = {
    "motion": "_MotionTex",
    "haze": "_HazeTex",
    "normals": "_NormalMap",
    "smoke": "_SmokeTex",
}
"""Names of the page's secondary textures, by the kind of map; Unity's 2D lights read the normals by
this name."""

_HAZE_SHADER = "haze.shader.j2"
_HEAT = ".heat"
"""After the name of a build, in those of the shader and the material of its heat."""

_NO_CHANNEL = -1
"""Channel of heat that no page has: nothing is seen of a frame in it."""

_SCALE = re.compile(r"- _Scale: .*")

_EXPOSED = 6
"""Value of a flake material's ``_Light``: flakes are shown as film shows them."""


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
        self.states = state_names([state.name for state in animator_states(product.sheets[0])])

    def files(self) -> Iterator[OutputFile]:
        """Yield every file: shaders and scripts first, then what refers to them."""
        if (heat := self.product.sheets[0].heat) is not None:
            yield from self.heat(heat)
        elif self.product.sheets[0].alpha != "straight":
            yield from self.material(self.name, SPRITE_SHADER, "Sprite")
        if self.plays_flakes:
            yield from self.flakes()
        if self.begins_apart:
            yield from self.asset(
                self.script("start"), start_text(self.component("start")).encode()
            )
        has_scripts = not self.uses_package and (heat or self.plays_flakes or self.begins_apart)
        if self.options.assembly and has_scripts:
            text = assembly_text(self.options.namespace)
            yield from self.asset(self.options.namespace + ASSEMBLY_ENDING, text.encode())
        if self.product.sheets[0].has_map("haze"):
            shader = f"{self.options.namespace}/{self.name}/Haze"
            text = shader_text(_HAZE_SHADER, shader, self.name, universal=True)
            yield from self.asset(f"{self.name}.haze{SHADER_ENDING}", text.encode())
        if self.uses_package:
            for animation in self.product.lights:
                yield self.meta(light_file(self.product.stem(animation)))
        for sheet in self.product.sheets:
            yield from self.effect(sheet)

    def heat(self, heat: Heat) -> Iterator[OutputFile]:
        """Yield the shader, material and script of pages of heat, and how the ramp is imported."""
        yield from self.material(
            f"{self.name}{_HEAT}",
            HEAT_SHADER,
            "Heat",
            {"_Row": 0, "_Erosion": 0},
            {"_RampTex": self.guid(heat.ramp)},
        )
        if not self.uses_package:
            text = heat_player_text(self.component("heat"))
            yield from self.asset(self.script("heat"), text.encode())
        yield self.ramp_meta(heat)

    def ramp_meta(self, heat: Heat) -> OutputFile:
        """Return the ``.meta`` of the ramp: colours, neither compressed nor cut into sprites."""
        file = heat.ramp + META_ENDING
        old = read_meta(file, self.product.existing(file))
        fresh = rendered(
            "unity/texture.meta.j2",
            (scalar, single),
            guid=self.guid(heat.ramp),
            sprites=[],
            secondary=[],
            alpha="premultiplied",
            data=True,
            tight=False,
            srgb=True,
            compressed=False,
            max_size=max_texture_size(RAMP_WIDTH, len(heat.rows)),
            pixels_per_unit=self.options.pixels_per_unit,
        )
        return OutputFile(file, "import", merged(old, fresh, [*TEXTURE_KEYS]).encode())

    @property
    def uses_package(self) -> bool:
        """Whether the prefab has the scripts and shaders of the package, not its own."""
        return self.options.player == "package"

    @property
    def plays_flakes(self) -> bool:
        """Whether the prefab plays flakes: there are some, and the options allow it."""
        return bool(self.product.tracks) and self.options.flakes

    @property
    def begins_apart(self) -> bool:
        """Whether the prefab has a script of its own that lets a loop begin at any moment."""
        return bool(self.product.sheets[0].animations) and not self.uses_package

    def guid(self, file: str) -> str:
        """Return the GUID of an output: its existing one, or one derived from its name."""
        meta = file + META_ENDING
        old = read_meta(meta, self.product.existing(meta))
        return guids_in(old)[0] if old else guid_of(self.options.namespace, file)

    def asset(self, file: str, data: bytes, role: Role = "engine") -> Iterator[OutputFile]:
        """Yield a file and its ``.meta``."""
        yield OutputFile(file, role, data)
        yield self.meta(file)

    def meta(self, file: str) -> OutputFile:
        """Return the ``.meta`` of a file."""
        meta = file + META_ENDING
        old = read_meta(meta, self.product.existing(meta))
        return OutputFile(
            meta, "import", merged(old, meta_text(file, self.guid(file)), ()).encode()
        )

    def text(self, file: str, template: str, **context: object) -> Iterator[OutputFile]:
        """Yield a file rendered from a template, and its ``.meta``."""
        context = {"name": file[: file.rindex(".")], **context}
        yield from self.asset(
            file, rendered(f"unity/{template}", (scalar, single), **context).encode()
        )

    def material(
        self,
        stem: str,
        shared: str,
        title: str,
        floats: Mapping[str, int] | None = None,
        textures: Mapping[str, str] | None = None,
    ) -> Iterator[OutputFile]:
        """Yield a material, and its shader unless it has that of the package.

        An existing material is kept, as the user may have changed it; but where the shaders were
        the other ones before, it gets those of now.

        Args:
            stem: File stem of the material.
            shared: The shader in the package.
            title: Last part of the shader's name.
            floats: Float properties of a new material.
            textures: GUID of each of its textures.
        """
        used, unused = package_guid(shared), self.guid(stem + SHADER_ENDING)
        if not self.uses_package:
            used, unused = unused, used
            shader = f"{self.options.namespace}/{self.name}/{title}"
            text = shader_text(shader_template(shared), shader, self.name, universal=False)
            yield from self.asset(stem + SHADER_ENDING, text.encode())
        old = self.product.existing(stem + MATERIAL_ENDING)
        new = {"name": stem, "shader": used, "textures": textures or {}, "floats": floats or {}}
        material = (
            old.replace(unused.encode(), used.encode())
            if old
            else rendered("unity/material.mat.j2", (scalar, single), **new).encode()
        )
        yield from self.asset(stem + MATERIAL_ENDING, material, "import")

    def flakes(self) -> Iterator[OutputFile]:
        """Yield the tracks of the flakes, and the script and shader that play them."""
        if not self.uses_package:
            text = player_text(self.component("flakes"), f"{self.name}.flakes{TABLE_ENDING}")
            yield from self.asset(self.script("flakes"), text.encode())
        stem = f"{self.name}.flakes"
        yield from self.material(stem, FLAKES_SHADER, "Flakes", {"_Light": _EXPOSED})
        yield from self.asset(stem + TABLE_ENDING, flake_bytes(self.flakes_by_animation()))

    def script(self, played: Played) -> str:
        """Return the file name of the script that plays a part of this build."""
        return player_name(self.name, played) + SCRIPT_ENDING

    def component(self, played: Played) -> ComponentNames:
        """Return what that script calls things."""
        return ComponentNames(
            player_name(self.name, played),
            self.options.namespace,
            heading=f"Plays the {played} of the effect {self.name}. Written by fire-atlas; a "
            f"rebuild writes it again.",
            name=self.name,
            menu=f"{self.options.namespace}/{self.name} {played}",
            mesh=f"{self.name} {played}",
        )

    def flakes_by_animation(self) -> Iterator[AnimationFlakes]:
        """Yield every set of the flakes of each animation."""
        pivots = self.pivots()
        for animation in self.product.tracks:
            for tracks in self.product.all_tracks(animation):
                yield AnimationFlakes(self.states[animation], pivots[animation], tracks)

    def pivots(self) -> dict[str, tuple[float, float]]:
        """Return the pivot (x, y) of each animation in its full-size frame, px, y down."""
        sheet = self.product.sheets[0]
        pivots = {region.name: pivot_px(region) for region in sheet.regions}
        return {animation.name: pivots[animation.frames[0]] for animation in sheet.animations}

    def effect(self, sheet: AtlasSheet) -> Iterator[OutputFile]:
        """Yield the files of one scale: ``.meta`` of pages, animations, controller and prefab;
        single sprites are in the ``.meta`` alone."""
        sprites = sprites_of(sheet, self.guid)
        for i, page in enumerate(sheet.pages):
            yield self.page_meta(sheet, i, page.file, sprites)
            for sheet_map in sheet.maps:
                data = sheet_map.is_data
                yield self.page_meta(sheet, i, sheet_map.files[i], sprites, data=data)
        if sheet.has_map("haze"):
            yield from self.haze_material(sheet)
        if sheet.animations:
            yield from self.clips(sheet, sprites)
            yield from self.prefab(sheet, sprites)

    def haze_material(self, sheet: AtlasSheet) -> Iterator[OutputFile]:
        """Yield the material of a sheet's haze; of an existing one, only the scale is changed."""
        file, vectors = f"{sheet.name}.haze{MATERIAL_ENDING}", sheet.map("haze").vectors
        assert vectors is not None
        shader, floats = self.guid(f"{self.name}.haze{SHADER_ENDING}"), {"_Scale": vectors.scale}
        new = {
            "name": f"{sheet.name}.haze",
            "shader": shader,
            "textures": {},
            "floats": {**floats, "_Strength": 1},
        }
        text = rendered("unity/material.mat.j2", (scalar, single), **new)
        if old := self.product.existing(file):
            text = _SCALE.sub(f"- _Scale: {vectors.scale}", old.decode())
        yield from self.asset(file, text.encode(), "import")

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

        ``data`` is for vectors and light, imported without colour space, sprites or compression.
        """
        page, file = sheet.pages[index], image + META_ENDING
        is_heat = sheet.heat is not None and image == page.file
        size = max_texture_size(page.width, page.height)
        secondary = [
            {"guid": self.guid(sheet_map.files[index]), "name": _SECONDARY[sheet_map.kind]}
            for sheet_map in sheet.maps
            if sheet_map.kind in _SECONDARY and image == page.file
        ]
        fresh = rendered(
            "unity/texture.meta.j2",
            (scalar, single),
            guid=self.guid(image),
            sprites=[] if data else [sprites[region.name] for region in sheet.regions_of(index)],
            alpha=sheet.alpha,
            data=data,
            srgb=not data and not is_heat,
            compressed=not data and not is_heat,
            tight=sheet.has_meshes and not data,
            secondary=secondary,
            max_size=size,
            pixels_per_unit=self.options.pixels_per_unit * sheet.scale,
        )
        old = read_meta(file, self.product.existing(file))
        owned = [*TEXTURE_KEYS]
        owned += [SECONDARY_TEXTURES] if secondary else []
        owned += [MESH_TYPE] if sheet.has_meshes else []
        meta = with_max_size(merged(old, fresh, owned), size)
        return OutputFile(file, "import", meta.encode())

    def clips(self, sheet: AtlasSheet, sprites: dict[str, PageSprite]) -> Iterator[OutputFile]:
        """Yield an animation clip for each state, and the controller that plays them."""
        played = animator_states(sheet)
        stems = file_stems(sheet.title, [state.name for state in played])
        states = []
        for state in played:
            file = f"{sheet.name}{stems[state.name].removeprefix(sheet.title)}{CLIP_ENDING}"
            keys = [
                {"time": i / state.fps, "sprite": None if frame is None else sprites[frame]}
                for i, frame in enumerate(state.frames)
            ]
            yield from self.text(file, "clip.anim.j2", keys=keys, fps=state.fps, loop=state.loop)
            states.append(self.controller_state(state, self.guid(file)))
        parameter = BURNING if any(state.transitions for state in played) else None
        yield from self.text(
            sheet.name + CONTROLLER_ENDING,
            "animator.controller.j2",
            states=states,
            parameter=parameter,
        )

    def controller_state(self, state: AnimatorState, clip: str) -> dict[str, object]:
        """Return what the controller states of a state, whose clip has the GUID ``clip``."""
        return {
            "name": self.states[state.name],
            "id": self.state_id(state.name),
            "clip": clip,
            "transitions": [
                {
                    "id": local_file_id("transition", f"{step.before}/{step.after}"),
                    "target": self.state_id(step.after),
                    "exit_time": step.exit_time,
                    "offset": step.offset,
                    "burning": step.burning,
                }
                for step in state.transitions
            ],
        }

    def state_id(self, name: str) -> int:
        """Return the local file id of a state."""
        return local_file_id("state", self.states[name])

    def prefab(self, sheet: AtlasSheet, sprites: dict[str, PageSprite]) -> Iterator[OutputFile]:
        """Yield the prefab of one scale, which a user drags into a scene."""
        first = sprites[sheet.animations[0].frames[0]]
        units = self.options.pixels_per_unit * sheet.scale
        material = f"{{fileID: 2100000, guid: {self.guid(self.name + MATERIAL_ENDING)}, type: 2}}"
        # The sprite of a page of heat is not drawn, so any material does.
        plain = sheet.alpha == "straight" or sheet.heat is not None
        own = not self.uses_package
        player = {
            "script": self.guid(self.script("flakes")) if own else package_guid(FLAKES),
            "material": self.guid(f"{self.name}.flakes{MATERIAL_ENDING}"),
            "tracks": self.guid(f"{self.name}.flakes{TABLE_ENDING}"),
            "pixels_per_unit": self.options.pixels_per_unit,
            "baked": bool(self.product.baked),
        }
        yield from self.text(
            sheet.name + PREFAB_ENDING,
            "effect.prefab.j2",
            sprite=first,
            size=(first.rect.width / units, first.rect.height / units),
            material=_DEFAULT_SPRITE_MATERIAL if plain else material,
            controller=self.guid(sheet.name + CONTROLLER_ENDING),
            player=player if self.plays_flakes else None,
            heat=self.heat_player(sheet, sprites) if sheet.heat is not None else None,
            whole=self.whole_player() if self.uses_package else None,
            variants=[self.states[name] for name in first_of_variants(sheet)],
            start=self.guid(self.script("start")) if self.begins_apart else None,
        )

    def heat_player(
        self, sheet: AtlasSheet, sprites: Mapping[str, PageSprite]
    ) -> dict[str, object]:
        """Return what the prefab states of the player of heat."""
        own = not self.uses_package
        channel = {region.name: CHANNELS.index(region.channel or "r") for region in sheet.regions}
        first = sprites[sheet.animations[0].frames[0]]
        return {
            "script": self.guid(self.script("heat")) if own else package_guid(HEAT),
            "material": self.guid(f"{self.name}{_HEAT}{MATERIAL_ENDING}"),
            "states": [
                {
                    "name": self.states[state.name],
                    "frames": [
                        {"sprite": first, "channel": _NO_CHANNEL}
                        if frame is None
                        else {"sprite": sprites[frame], "channel": channel[frame]}
                        for frame in state.frames
                    ],
                }
                for state in animator_states(sheet)
            ],
        }

    def whole_player(self) -> dict[str, object]:
        """Return what the prefab states of the package's player of flame, flakes and lamp."""
        height = self.product.sheets[0].regions[0].frame_height / self.options.pixels_per_unit
        pivots = self.pivots()
        return {
            "script": package_guid(PLAYER),
            "pixels_per_unit": self.options.pixels_per_unit,
            "shows_flakes": self.plays_flakes and not self.product.baked,
            "lights": [
                {
                    "state": self.states[animation],
                    "track": self.guid(light_file(self.product.stem(animation))),
                    "pivot": pivots[animation],
                }
                for animation in self.product.lights
            ],
            "range": _LAMP_RANGE * height,
            "depth": -_LAMP_DEPTH * height,
        }
