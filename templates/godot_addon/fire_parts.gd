@tool
extends RefCounted
# The parts of a scene that fire-atlas built, as the nodes of this add-on use them.

# The variant of the next fire that is placed.
static var _next_variant: int = randi() % 16

# The scene, which belongs to whoever asked for its parts.
var root: Node
# Plays the flame.
var sprite: AnimatedSprite2D
# Flies the sparks; null without.
var sparks: MultiMeshInstance2D
# Shines; null without.
var lamp: PointLight2D
# Gives heat its colours; null if the pages have colours.
var heat: ShaderMaterial
# Whether the scene leads from animation to animation itself: as the wind changes, or as the fire is
# lit and put out.
var leads_on: bool = false
# Whether there is smoke under the fire, which a shader of the scene draws.
var has_smoke: bool = false
# Whether the pages hold straight colours.
var is_straight: bool = false
# Whether the pages show the sparks, so that nothing else may.
var is_baked: bool = false
# What begins the names of the animations of each variant; empty if there is one only.
var variants: PackedStringArray = []


# Returns the parts of a new instance of a scene; null if fire-atlas did not build it.
static func of(scene: PackedScene) -> RefCounted:
	if scene == null:
		return null
	var parts: RefCounted = new()
	return parts if parts.take(scene.instantiate()) else null


# What the editor says of a node whose scene is missing or no fire, or shows sparks that are to be
# hidden.
static func warnings(scene: PackedScene, is_fire: bool, hides_baked: bool) -> PackedStringArray:
	if scene == null:
		return ["Drag the scene that a build wrote, like campfire.tscn, to the property Fire."]
	if not is_fire:
		return [
			"%s is not such a scene: drag one that a build wrote, like campfire.tscn, to Fire."
			% scene.resource_path
		]
	if hides_baked:
		return ["The pages show the sparks: to hide them, build with flakes: {bake: false}."]
	return []


# Returns a stated variant; for -1 the next one.
static func chosen_variant(stated: int) -> int:
	if stated >= 0:
		return stated
	_next_variant += 1
	return _next_variant - 1


# Shows a variant: its animation in place of that of another one.
func show_variant(number: int) -> void:
	sprite.set("variant", number)
	if sprite.sprite_frames.has_animation(of_variant(sprite.animation, number)):
		sprite.animation = of_variant(sprite.animation, number)


# Returns the animation of a variant for one of any variant of the same fire.
func of_variant(title: String, number: int) -> String:
	for stem in variants:
		if title == stem or title.begins_with(stem + "_"):
			var fire: String = stem.rstrip("0123456789")
			var count: int = 0
			for other in variants:
				count += int(other.rstrip("0123456789") == fire)
			return fire + str(number % count) + title.substr(stem.length())
	return title


# Returns a moment to begin at, in frames: any of a loop, the first of what plays once.
static func any_moment(frames: SpriteFrames, title: StringName) -> float:
	return randf() * frames.get_frame_count(title) if frames.get_animation_loop(title) else 0.0


# Takes the parts of a scene; frees it and returns false if they are not there.
func take(scene: Node) -> bool:
	root = scene
	sprite = root as AnimatedSprite2D
	if sprite == null:
		sprite = root.get_node_or_null("Film/Fire") as AnimatedSprite2D
	if sprite == null:
		root.free()
		return false
	sprite.autoplay = ""
	# A node of this add-on begins it.
	sprite.set("random_start", false)
	sprite.set("speed_spread", 0.0)
	sprite.set("random_mirror", false)
	if "variants" in sprite:
		variants = sprite.get("variants")
	sparks = sprite.get_node_or_null("Flakes") as MultiMeshInstance2D
	lamp = sprite.get_node_or_null("Light") as PointLight2D
	heat = sprite.material as ShaderMaterial if sprite.has_node("Heat") else null
	leads_on = "wind" in sprite or "burning" in sprite
	is_baked = sparks != null and not sparks.visible
	_take_material()
	return true


# What the sprite's material tells of the pages.
func _take_material() -> void:
	var shaded: ShaderMaterial = sprite.material as ShaderMaterial
	has_smoke = shaded != null and shaded.get_shader_parameter("smoke") != null
	if has_smoke:
		is_straight = shaded.get_shader_parameter("is_straight")
		return
	var plain: CanvasItemMaterial = sprite.material as CanvasItemMaterial
	is_straight = plain == null or plain.blend_mode != CanvasItemMaterial.BLEND_MODE_PREMULT_ALPHA


# Shows an animation from its first frame; says which there are if it is none of them.
func choose(title: StringName) -> void:
	if title == &"" or title == sprite.animation:
		return
	if sprite.sprite_frames.has_animation(title):
		sprite.animation = title
	else:
		var known: String = ", ".join(sprite.sprite_frames.get_animation_names())
		push_warning("%s has no animation %s; there are: %s" % [root.name, title, known])
