@tool
@icon("fire_atlas_3d.svg")
class_name FireAtlas3D
extends Node3D
## A fire that fire-atlas built, in space: flame, sparks and lamp as one node.
##
## Drag the scene that a build wrote, like [code]torch.tscn[/code], to [member fire]. The node's own
## place is the foot of the fire. The flame is a sprite that always faces the camera. If the recipe
## has [code]views[/code], it shows the one nearest to where the viewport's camera is; the front of
## the fire is towards the node's +z. Views look right at the elevation that they were built for.
## [br]
## Sparks fly in space if the recipe makes fire with depth (sources [code]silk[/code] and
## [code]profile[/code]) and does not bake them. [br]
## The editor shows a lamp that stands still.

## Emitted when an animation that does not loop has ended.
signal animation_finished
## Emitted each time a loop begins again.
signal looped
## Emitted when a fire that was lit burns: see [method ignite].
signal lit
## Emitted when a fire that was put out is out: see [method extinguish].
signal went_out

const FireParts := preload("fire_parts.gd")
## Least cosine of a view's elevation at which it tells how high the lamp is.
const MIN_COSINE: float = 0.2

## The scene that a build wrote, like [code]torch.tscn[/code].
@export var fire: PackedScene:
	set(scene):
		fire = scene
		_show_fire()
## The scene of its sparks in space, [code]torch_flakes_3d.tscn[/code]. Without it the one that lies
## beside the fire's frames is used; name it if you export chosen scenes alone.
@export var sparks_scene: PackedScene:
	set(scene):
		sparks_scene = scene
		_show_fire()
## The animation that is shown, from its first frame; the views of one fire are one animation.
@export var animation: StringName:
	set(title):
		animation = title
		_choose()
		if _sprite != null and title != &"" and not title in _fires():
			push_warning("%s has no animation %s; there are: %s" % [name, title, ", ".join(_fires())])
## Whether it plays. At the end of an animation that does not loop this becomes false.
@export var playing: bool = true:
	set(on):
		playing = on
		_play_or_pause()
## How fast it plays: 2 is twice as fast, -1 backwards.
@export var speed_scale: float = 1.0:
	set(times):
		speed_scale = times
		_apply()
## Whether a loop begins at a moment of its own, so that several in a scene do not flicker in step.
## What plays once begins at its beginning.
@export var random_start: bool = true
## How far a loop's speed may be from [member speed_scale]: at 0.1 up to a tenth slower or faster.
@export_range(0.0, 0.9, 0.01) var speed_spread: float = 0.1:
	set(part):
		speed_spread = part
		_apply()
## Which variant is shown, the first is 0; -1: the next one for each fire that is placed.
@export_range(-1, 15) var variant: int = -1:
	set(number):
		variant = number
		_show_fire()
## Whether a fire with the recipe's [code]phases[/code] is to burn; without it from the start, the
## fire is out.
@export var burning: bool = true:
	set(on):
		burning = on
		_apply()
		_play_or_pause()
## Size of a pixel of the frames, m, as of a Sprite3D.
@export_range(0.0001, 1.0, 0.0001, "or_greater") var pixel_size: float = 0.01:
	set(size):
		pixel_size = size
		_show_fire()
## Colour by which flame and lamp are multiplied; its alpha fades the sparks. To fade a fire of
## straight pages, animate its alpha; of premultiplied and additive pages all four.
@export var modulate: Color = Color.WHITE:
	set(colour):
		modulate = colour
		_apply()
@export_group("Sparks", "sparks_")
## Whether sparks are shown. Those that the pages show ([code]flakes: {bake: true}[/code]) stay.
@export var sparks_shown: bool = true:
	set(on):
		sparks_shown = on
		_apply()
		update_configuration_warnings()
## Their light, relative to what the build made: brighter sparks are yellower, dimmer ones redder.
@export_range(0.0, 4.0, 0.01, "or_greater") var sparks_brightness: float = 1.0:
	set(times):
		sparks_brightness = times
		_apply()
@export_group("Lamp", "lamp_")
## Whether the lamp shines. There is one if the recipe has [code]tracks: [light][/code].
@export var lamp_shines: bool = true:
	set(on):
		lamp_shines = on
		_apply()
## Energy of the lamp when the fire is as bright as in the mean.
@export_range(0.0, 16.0, 0.01, "or_greater") var lamp_energy: float = 1.0:
	set(energy):
		lamp_energy = energy
		_apply()
## How far the lamp reaches, m.
@export_range(0.0, 100.0, 0.01, "or_greater") var lamp_range: float = 5.0:
	set(distance):
		lamp_range = distance
		_apply()
## Whether the lamp casts shadows.
@export var lamp_shadow: bool = false:
	set(on):
		lamp_shadow = on
		_apply()

var _sprite: AnimatedSprite3D
# The scene of a fire with phases, in two dimensions, and what hides it. It plays unseen, and the
# sprite shows what it shows; null without phases.
var _leader: AnimatedSprite2D
var _veil: Node2D
var _sparks: MultiMeshInstance3D
var _lamp: OmniLight3D
# The lamp of the scene in two dimensions, which knows how the fire shines. It is not shown.
var _light: PointLight2D
# Where the sprite has its corner in the scene in two dimensions, px from the pivot, y down.
var _corner: Vector2
# Whether the scene's pages hold straight colours, and show the sparks.
var _is_straight: bool = false
var _is_baked: bool = false
# Whether the scene has smoke under its fire, which sprites in space do not show.
var _has_smoke: bool = false
# What is known of the views of fires with depth, by animation; and those of the shown fire.
var _views: Dictionary = {}
var _shown: Array[StringName] = []
# What is known of the scene's variants, and which is shown.
var _parts: FireParts
var _number: int = 0
# Rounds of the loop that have passed: sparks repeat after several.
var _round: int = 0
# How fast a loop plays: -1 is the slowest that `speed_spread` allows, 1 the fastest.
var _off_pace: float = randf_range(-1.0, 1.0)


func _ready() -> void:
	_show_fire()


func _process(_delta: float) -> void:
	if _sprite == null or not is_visible_in_tree():
		return
	if _leader != null:
		_follow()
	_turn()
	var time: float = _sprite.frame + _sprite.frame_progress
	if _sparks != null and _sparks.visible:
		var count: int = _sprite.sprite_frames.get_frame_count(_sprite.animation)
		_sparks.call("seek", _shown[0], _round * count + time)
	# The scene's lamp has no tool script: in the editor it tells nothing.
	if _lamp != null and _lamp.visible and not Engine.is_editor_hint():
		_shine(time)


## Plays an animation from its first frame; without a name, the one that is shown.
func play(title: StringName = &"") -> void:
	if title != &"":
		animation = title
	seek(0.0)
	playing = true


## Shows a moment of the animation, in frames: 2.5 is half way from frame 2 to frame 3.
func seek(time: float) -> void:
	if _sprite != null:
		_player().call("set_frame_and_progress", floori(time), time - floorf(time))


## Lights a fire that has [code]phases[/code]; one that is going out goes out first.
func ignite() -> void:
	burning = true


## Puts out a fire that has [code]phases[/code]; one that is being lit burns first.
func extinguish() -> void:
	burning = false


func _get_configuration_warnings() -> PackedStringArray:
	var said := FireParts.warnings(fire, _sprite != null, _is_baked and not sparks_shown)
	if _sprite != null and _has_smoke:
		said.append("In space the fire is shown without its smoke: build it without maps.smoke.")
	return said


func _validate_property(property: Dictionary) -> void:
	if property["name"] == "animation" and _sprite != null:
		property["hint"] = PROPERTY_HINT_ENUM
		property["hint_string"] = ",".join(_fires())
	if property["name"] == "variant" and (_parts == null or _parts.variants.is_empty()):
		property["usage"] &= ~PROPERTY_USAGE_EDITOR
	if property["name"] == "burning" and _leader == null:
		property["usage"] &= ~PROPERTY_USAGE_EDITOR


# The scene of sparks in space, or the one that a build wrote beside its frames of whatever scale.
func _scene_of_sparks(frames: SpriteFrames) -> PackedScene:
	var stem: String = frames.resource_path.get_basename().get_slice("@", 0)
	var path: String = stem + "_flakes_3d.tscn"
	if sparks_scene != null or not ResourceLoader.exists(path):
		return sparks_scene
	return load(path)


func _show_fire() -> void:
	if not is_node_ready():
		return
	for node: Node in [_sprite, _sparks, _lamp, _light, _veil]:
		if node != null:
			remove_child(node)
			node.queue_free()
	_sprite = null
	_sparks = null
	_lamp = null
	_light = null
	_leader = null
	_veil = null
	var parts: FireParts = FireParts.of(fire)
	if parts != null:
		# A film scene shows the flame through a shader of its own, in two dimensions, as heat is.
		if parts.sprite == parts.root and parts.heat == null:
			_add(parts)
		if _leader == null:
			parts.root.free()
		_begin_apart()
	notify_property_list_changed()
	update_configuration_warnings()


# Begins a loop at a moment of its own.
func _begin_apart() -> void:
	if _sprite != null and random_start:
		seek(FireParts.any_moment(_sprite.sprite_frames, _sprite.animation))


# Adds what is shown of the parts of a scene in two dimensions.
func _add(parts: FireParts) -> void:
	_views = parts.root.get_meta("views", {})
	_parts = parts
	_number = FireParts.chosen_variant(variant)
	_parts.show_variant(_number)
	_corner = parts.sprite.offset
	_is_baked = parts.is_baked
	_is_straight = parts.is_straight
	_has_smoke = parts.has_smoke
	_sprite = AnimatedSprite3D.new()
	_sprite.sprite_frames = _as_rectangles(parts.sprite.sprite_frames)
	_sprite.centered = false
	_sprite.pixel_size = pixel_size
	_sprite.material_override = _material(parts.sprite)
	# It moves on before this node, so that the sparks are in step with it.
	_sprite.process_priority = process_priority - 1
	if "burning" in parts.sprite:
		_leader = parts.sprite
		_leader.process_priority = process_priority - 1
		_leader.animation_looped.connect(_begin_round)
		_leader.connect("lit", lit.emit)
		_leader.connect("went_out", went_out.emit)
	else:
		_sprite.animation_finished.connect(_end)
		_sprite.animation_looped.connect(_begin_round)
	_sprite.frame_changed.connect(_show_page)
	_sprite.animation_changed.connect(_show_page)
	add_child(_sprite, false, INTERNAL_MODE_FRONT)
	var sparks: PackedScene = _scene_of_sparks(parts.sprite.sprite_frames)
	if sparks != null:
		_sparks = sparks.instantiate() as MultiMeshInstance3D
		_sparks.set("playing", false)
		var scale_of_sheet: float = 1.0 if parts.sparks == null else parts.sparks.scale.x
		_sparks.set("pixel_size", pixel_size * scale_of_sheet)
		add_child(_sparks, false, INTERNAL_MODE_FRONT)
	if parts.lamp != null:
		_light = parts.lamp
		_light.get_parent().remove_child(_light)
		_light.visible = false
		add_child(_light, false, INTERNAL_MODE_FRONT)
		_lamp = OmniLight3D.new()
		_lamp.light_color = _light.color
		_lamp.position = Vector3(0.0, -_light.position.y * pixel_size, 0.0)
		add_child(_lamp, false, INTERNAL_MODE_FRONT)
	_choose()
	_apply()
	_play_or_pause()
	if _leader != null:
		_veil = Node2D.new()
		_veil.visible = false
		_veil.add_child(_leader)
		add_child(_veil, false, INTERNAL_MODE_FRONT)
		_follow()


# The frames as rectangles of their pages: where they are meshes, sprites in space do not draw them.
static func _as_rectangles(frames: SpriteFrames) -> SpriteFrames:
	var flat: SpriteFrames = frames.duplicate()
	for title in flat.get_animation_names():
		for i in flat.get_frame_count(title):
			var meshed: MeshTexture = flat.get_frame_texture(title, i) as MeshTexture
			if meshed != null:
				var duration: float = flat.get_frame_duration(title, i)
				flat.set_frame(title, i, _rectangle_of(meshed), duration)
	return flat


# The smallest rectangle around a mesh.
static func _rectangle_of(meshed: MeshTexture) -> AtlasTexture:
	var arrays: Array = meshed.mesh.surface_get_arrays(0)
	var page: Texture2D = meshed.base_texture
	var drawn: Rect2 = _bounds(arrays[Mesh.ARRAY_VERTEX])
	var place: Rect2 = _bounds(arrays[Mesh.ARRAY_TEX_UV])
	var flat: AtlasTexture = AtlasTexture.new()
	flat.atlas = page
	flat.region = Rect2((place.position * page.get_size()).round(), drawn.size)
	flat.margin = Rect2(drawn.position, meshed.image_size - drawn.size)
	flat.filter_clip = true
	return flat


static func _bounds(points: PackedVector2Array) -> Rect2:
	var bounds: Rect2 = Rect2(points[0], Vector2.ZERO)
	for point in points:
		bounds = bounds.expand(point)
	return bounds


# The sprite's material: as that of the scene in two dimensions, and turned to the camera.
func _material(flat: AnimatedSprite2D) -> StandardMaterial3D:
	var material: StandardMaterial3D = StandardMaterial3D.new()
	material.transparency = BaseMaterial3D.TRANSPARENCY_ALPHA
	if not _is_straight:
		material.blend_mode = BaseMaterial3D.BLEND_MODE_PREMULT_ALPHA
	material.shading_mode = BaseMaterial3D.SHADING_MODE_UNSHADED
	material.billboard_mode = BaseMaterial3D.BILLBOARD_ENABLED
	material.billboard_keep_scale = true
	material.vertex_color_use_as_albedo = true
	material.vertex_color_is_srgb = true
	var is_sharp: bool = flat.texture_filter == CanvasItem.TEXTURE_FILTER_NEAREST
	material.texture_filter = (
		BaseMaterial3D.TEXTURE_FILTER_NEAREST if is_sharp else BaseMaterial3D.TEXTURE_FILTER_LINEAR
	)
	return material


# Names of the fires of the scene: animations, of which all views of a fire are one.
func _fires() -> PackedStringArray:
	var names: PackedStringArray = []
	for title in _sprite.sprite_frames.get_animation_names():
		var fire_of_view: String = _views[title]["fire"] if title in _views else title
		if not fire_of_view in names:
			names.append(fire_of_view)
	return names


# Shows the chosen animation from its first frame, or the first one if there is no such.
func _choose() -> void:
	if _sprite == null:
		return
	var names: PackedStringArray = _fires()
	var chosen: String = animation if animation in names else names[0]
	chosen = _parts.of_variant(chosen, _number)
	_shown = []
	for title in _sprite.sprite_frames.get_animation_names():
		if (_views[title]["fire"] if title in _views else title) == chosen:
			_shown.append(title)
	_shown.sort_custom(func(a: String, b: String) -> bool: return _azimuth(a) < _azimuth(b))
	_round = 0
	_sprite.animation = _shown[0]
	_player().set("animation", _shown[0])
	seek(0.0)
	_place()


# What plays: the scene that leads, or the sprite itself.
func _player() -> Node:
	return _sprite if _leader == null else _leader


# Shows what the scene in two dimensions shows. A fire with phases has one view.
func _follow() -> void:
	if _sprite.animation != _leader.animation:
		_shown = [_leader.animation]
		_round = 0
		_sprite.animation = _leader.animation
		_place()
	_sprite.set_frame_and_progress(_leader.frame, _leader.frame_progress)
	if _sprite.visible != _leader.visible:
		_apply()


func _azimuth(title: StringName) -> float:
	return _views[title]["azimuth"] if title in _views else 0.0


# Shows the view nearest to the camera, at the same moment.
func _turn() -> void:
	var title: StringName = _nearest(get_viewport().get_camera_3d())
	if title == _sprite.animation:
		return
	var frame: int = _sprite.frame
	var progress: float = _sprite.frame_progress
	_sprite.animation = title
	_sprite.set_frame_and_progress(frame, progress)
	_place()


func _nearest(eye: Camera3D) -> StringName:
	var nearest: StringName = _shown[0]
	if eye == null or _shown.size() == 1:
		return nearest
	var sight: Vector3 = eye.global_position - global_position
	if eye.projection == Camera3D.PROJECTION_ORTHOGONAL:
		sight = eye.global_basis.z
	sight = sight * global_basis.orthonormalized()
	var seen: float = rad_to_deg(atan2(sight.x, sight.z))
	var least: float = INF
	for title in _shown:
		var off: float = absf(wrapf(_azimuth(title) - seen, -180.0, 180.0))
		if off < least:
			least = off
			nearest = title
	return nearest


# Puts the shown view where the foot of the fire is the node's own place.
func _place() -> void:
	var title: StringName = _sprite.animation
	var foot: Vector2 = _views[title]["foot"] if title in _views else Vector2.ZERO
	var height: float = _sprite.sprite_frames.get_frame_texture(title, 0).get_height()
	_sprite.offset = Vector2(_corner.x - foot.x, foot.y - _corner.y - height)
	_show_page()


# Gives the material the page that the shown frame lies on.
func _show_page() -> void:
	var texture: Texture2D = _sprite.sprite_frames.get_frame_texture(
		_sprite.animation, _sprite.frame
	)
	var material: StandardMaterial3D = _sprite.material_override
	material.albedo_texture = texture.atlas if texture is AtlasTexture else texture


# Shines as all views of the fire do in the mean, from where they see its light together.
func _shine(time: float) -> void:
	var energy: float = 0.0
	var colour: Color = Color.BLACK
	var place: Vector3 = Vector3.ZERO
	for title in _shown:
		_light.call("seek", title, time)
		energy += _light.energy / _shown.size()
		colour += _light.color / _shown.size()
		place += _place_of_light(title) / _shown.size()
	_lamp.light_energy = energy * lamp_energy
	var fade: float = modulate.a if _is_straight else 1.0
	_lamp.light_color = colour * modulate * fade
	_lamp.position = place * pixel_size


# What a view tells of the place of the light, px: its height, and how far it is to the view's
# right. The mean of views all around is the place; fewer than three do not tell it in depth.
func _place_of_light(title: StringName) -> Vector3:
	if not title in _views:
		return Vector3(0.0, -_light.position.y, 0.0)
	var off: Vector2 = _light.position - _views[title]["foot"]
	var height: float = -off.y / maxf(cos(deg_to_rad(_views[title]["elevation"])), MIN_COSINE)
	var right: Vector3 = Vector3.RIGHT.rotated(Vector3.UP, deg_to_rad(_azimuth(title)))
	var is_around: bool = _shown.size() > 2
	return Vector3(0.0, height, 0.0) + (right * off.x * 2.0 if is_around else Vector3.ZERO)


func _play_or_pause() -> void:
	if _sprite == null:
		return
	_player().call("play" if playing else "pause")


func _apply() -> void:
	if _sprite == null:
		return
	if _leader != null:
		_leader.set("burning", burning)
		_sprite.visible = _leader.visible
	var loops: bool = _sprite.sprite_frames.get_animation_loop(_sprite.animation)
	_player().set("speed_scale", speed_scale * (1.0 + (speed_spread * _off_pace if loops else 0.0)))
	_sprite.modulate = modulate
	if _sparks != null:
		_sparks.visible = sparks_shown and not _is_baked and _sprite.visible
		_sparks.set("brightness", sparks_brightness * modulate.a)
	if _lamp != null:
		_lamp.visible = lamp_shines and _sprite.visible
		_lamp.light_energy = lamp_energy
		_lamp.omni_range = lamp_range
		_lamp.shadow_enabled = lamp_shadow


func _begin_round() -> void:
	_round += -1 if speed_scale < 0.0 else 1
	looped.emit()


func _end() -> void:
	playing = false
	animation_finished.emit()
