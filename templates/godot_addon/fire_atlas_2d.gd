@tool
@icon("fire_atlas_2d.svg")
class_name FireAtlas2D
extends Node2D
## A fire that fire-atlas built: flame, sparks and lamp as one node.
##
## Drag the scene that a build wrote, like [code]campfire.tscn[/code], to [member fire]. The node's
## own place is the foot of the fire (the recipe's [code]atlas.pivot[/code]). [br]
## To fade a fire of straight pages, animate [code]modulate.a[/code]; premultiplied and additive
## pages are light already: fade all four, [code]modulate = Color(a, a, a, a)[/code]. Sparks and
## lamp fade with the flame.

## Emitted when an animation that does not loop has ended.
signal animation_finished
## Emitted each time a loop begins again.
signal looped
## Emitted when a fire that was lit burns: see [method ignite].
signal lit
## Emitted when a fire that was put out is out: see [method extinguish].
signal went_out

const FireParts := preload("fire_parts.gd")

## The scene that a build wrote: [code]campfire.tscn[/code], or [code]campfire_film.tscn[/code],
## which adds up the light of flame and sparks and has no lamp.
@export var fire: PackedScene:
	set(scene):
		fire = scene
		_show_fire()
## The animation that is shown; another one begins at its first frame.
@export var animation: StringName:
	set(title):
		animation = title
		if _parts != null:
			_parts.choose(title)
	get:
		return animation if _parts == null else _parts.sprite.animation
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
## Whether every other fire, at random, is its mirror image: in wind it leans the other way.
@export var random_mirror: bool = false
## Which variant is shown, the first is 0; -1: the next one for each fire that is placed.
@export_range(-1, 15) var variant: int = -1:
	set(number):
		variant = number
		_show_fire()
## The wind, in levels of the recipe's [code]wind.levels[/code]: the fire passes to the nearest one.
@export var wind: float = 0.0:
	set(level):
		wind = level
		_apply()
## Whether a fire with the recipe's [code]phases[/code] is to burn; without it from the start, the
## fire is out.
@export var burning: bool = true:
	set(on):
		burning = on
		_apply()
		_play_or_pause()
@export_group("Heat")
## Colours of a fire whose pages hold heat ([code]atlas.pixels: heat[/code]): any texture with
## nothing at its left end, like a GradientTexture1D. Without it, those that the build wrote.
@export var ramp: Texture2D:
	set(colours):
		ramp = colours
		_apply()
## Row of the ramp, the topmost is 0.
@export_range(0, 63) var ramp_row: int = 0:
	set(row):
		ramp_row = row
		_apply()
## Heat that is taken away: the fire dies from its rim inwards, and at 1 nothing is left.
@export_range(0.0, 1.0, 0.01) var erosion: float = 0.0:
	set(heat):
		erosion = heat
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

var _parts: FireParts
# The ramp that the build wrote.
var _own_ramp: Texture2D
# How fast a loop plays: -1 is the slowest that `speed_spread` allows, 1 the fastest.
var _off_pace: float = randf_range(-1.0, 1.0)


func _ready() -> void:
	_begin_apart()


## Plays an animation from its first frame; without a name, the one that is shown.
func play(title: StringName = &"") -> void:
	if title != &"":
		animation = title
	seek(0.0)
	playing = true


## Shows a moment of the animation, in frames: 2.5 is half way from frame 2 to frame 3.
func seek(time: float) -> void:
	if _parts != null:
		_parts.sprite.set_frame_and_progress(floori(time), time - floorf(time))


## Lights a fire that has [code]phases[/code]; one that is going out goes out first.
func ignite() -> void:
	burning = true


## Puts out a fire that has [code]phases[/code]; one that is being lit burns first.
func extinguish() -> void:
	burning = false


func _get_configuration_warnings() -> PackedStringArray:
	var hides_baked: bool = _parts != null and _parts.is_baked and not sparks_shown
	return FireParts.warnings(fire, _parts != null, hides_baked)


func _validate_property(property: Dictionary) -> void:
	if property["name"] == "animation" and _parts != null:
		property["hint"] = PROPERTY_HINT_ENUM
		property["hint_string"] = ",".join(_parts.sprite.sprite_frames.get_animation_names())
	var has_heat: bool = _parts != null and _parts.heat != null
	if property["name"] in ["ramp", "ramp_row", "erosion"] and not has_heat:
		property["usage"] &= ~PROPERTY_USAGE_EDITOR
	if property["name"] == "variant" and (_parts == null or _parts.variants.is_empty()):
		property["usage"] &= ~PROPERTY_USAGE_EDITOR
	if property["name"] in ["wind", "burning"]:
		if _parts == null or not property["name"] in _parts.sprite:
			property["usage"] &= ~PROPERTY_USAGE_EDITOR


func _show_fire() -> void:
	var title: StringName = animation
	if _parts != null:
		remove_child(_parts.root)
		_parts.root.queue_free()
	_parts = FireParts.of(fire)
	if _parts != null:
		_own_ramp = _parts.heat.get_shader_parameter("ramp") if _parts.heat != null else null
		if not _parts.leads_on:
			_parts.sprite.animation_finished.connect(_end)
		if _parts.sprite.has_signal("lit"):
			_parts.sprite.connect("lit", lit.emit)
			_parts.sprite.connect("went_out", went_out.emit)
		_parts.sprite.animation_looped.connect(looped.emit)
		# Another fire may have other animations: then it shows its own first one.
		if _parts.sprite.sprite_frames.has_animation(title):
			_parts.choose(title)
		_parts.show_variant(FireParts.chosen_variant(variant))
		_play_or_pause()
		_apply()
		add_child(_parts.root, false, Node.INTERNAL_MODE_FRONT)
		_begin_apart()
	notify_property_list_changed()
	update_configuration_warnings()


# Begins a loop at a moment of its own, and mirrors the fire or does not.
func _begin_apart() -> void:
	if _parts != null and is_node_ready() and random_mirror and randi() % 2 == 1:
		_parts.root.scale.x = -_parts.root.scale.x
	if _parts != null and is_node_ready() and random_start:
		seek(FireParts.any_moment(_parts.sprite.sprite_frames, _parts.sprite.animation))


func _play_or_pause() -> void:
	if _parts == null:
		return
	if playing:
		_parts.sprite.play()
	else:
		_parts.sprite.pause()


func _apply() -> void:
	if _parts == null:
		return
	var loops: bool = _parts.sprite.sprite_frames.get_animation_loop(_parts.sprite.animation)
	_parts.sprite.speed_scale = speed_scale * (1.0 + (speed_spread * _off_pace if loops else 0.0))
	_parts.sprite.set("wind", wind)
	_parts.sprite.set("burning", burning)
	if _parts.heat != null:
		_parts.heat.set_shader_parameter("ramp", ramp if ramp != null else _own_ramp)
		_parts.heat.set_shader_parameter("row", ramp_row)
		_parts.heat.set_shader_parameter("erosion", erosion)
	if _parts.sparks != null:
		_parts.sparks.visible = sparks_shown and not _parts.is_baked
		_parts.sparks.set("brightness", sparks_brightness)
	if _parts.lamp != null:
		_parts.lamp.visible = lamp_shines
		_parts.lamp.set("mean_energy", lamp_energy)


func _end() -> void:
	playing = false
	animation_finished.emit()
