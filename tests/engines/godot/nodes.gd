extends Node
# Uses the nodes of the add-on as a game does.

const ADDON := "res://addons/fire_atlas/fire_atlas_%s.gd"

var _ended: int = 0
var _looped: int = 0
var _signals: Array = []


func answer(job: Dictionary) -> Variant:
	return await call(job["ask"], job)


# Answers a picture and the state of a FireAtlas2D after each of `steps`: properties are `set` to
# what texts say, a moment is sought, and time passes, `ticks` of 1/60 s.
func change(job: Dictionary) -> Array:
	var ground := _ground(job["background"])
	var fire := _fire("2d", job["scene"])
	fire.position = Vector2(job["at"][0], job["at"][1])
	fire.animation_finished.connect(func() -> void: _ended += 1)
	fire.looped.connect(func() -> void: _looped += 1)
	fire.lit.connect(func() -> void: _signals.append("lit"))
	fire.went_out.connect(func() -> void: _signals.append("went_out"))
	add_child(fire)
	var seen := []
	for step: Dictionary in job["steps"]:
		var changes: Dictionary = step.get("set", {})
		for property: String in changes:
			fire.set(property, str_to_var(changes[property]))
		if step.has("seek"):
			fire.seek(step["seek"])
		for tick in int(step.get("ticks", 0)):
			await get_tree().process_frame
		_make_meshes_anew(fire)
		var picture := await _picture()
		var sprite: AnimatedSprite2D = fire._parts.sprite
		var state := {"time": sprite.frame + sprite.frame_progress, "ended": _ended}
		state.merge({"looped": _looped, "playing": fire.playing, "animation": fire.animation})
		state["signals"] = _signals.duplicate()
		seen.append([picture, state])
	fire.free()
	ground.free()
	return seen


# Answers a picture of a FireAtlas2D for each of `times`, `apart` px, and the numbers of objects
# before these and a FireAtlas3D are made, and when they are freed.
func make_and_free(job: Dictionary) -> Array:
	var scene: PackedScene = load(job["scene"])
	var ground := _ground(job["background"])
	for kind: String in ["2d", "3d"]:  # the engine keeps some of what it makes for the first
		var first := _fire(kind, job["scene"])
		add_child(first)
		await _picture()
		first.free()
	var before := _counts()
	var fires := []
	for i in job["times"].size():
		var fire := _fire("2d", job["scene"])
		fire.position = Vector2(job["at"][0] + i * job["apart"], job["at"][1])
		fire.playing = false
		fire.sparks_shown = false
		add_child(fire)
		fire.seek(job["times"][i])
		fires.append(fire)
	var picture := await _picture()
	for fire: Node in fires:
		fire.fire = null
		fire.fire = scene
	fires.append(_fire("3d", job["scene"]))
	add_child(fires[-1])
	await _picture()
	for fire: Node in fires:
		fire.free()
	fires.clear()
	await _picture()
	var after := _counts()
	ground.free()
	return [picture, before, after]


# Walks a camera that is `elevation` above the horizon round a FireAtlas3D. Answers for each of
# `azimuths` the view, a picture of the flame alone, and where sparks are: seen, px, and in space;
# and then the lamp's place, and its energy when `lamp_energy` is 3.
func walk(job: Dictionary) -> Dictionary:
	var room := WorldEnvironment.new()
	room.environment = Environment.new()
	room.environment.background_mode = Environment.BG_COLOR
	room.environment.background_color = Color(job["background"])
	add_child(room)
	var eye := Camera3D.new()
	eye.set_orthogonal(job["height"], 0.01, 100.0)
	add_child(eye)
	eye.make_current()
	var fire := _fire("3d", job["scene"])
	fire.playing = false
	fire.rotation.y = job["turned"]
	add_child(fire)
	fire.seek(job["time"])
	var steps := []
	for azimuth: float in job["azimuths"]:
		var turn := Basis.from_euler(Vector3(-job["elevation"], azimuth + job["turned"], 0.0))
		eye.transform = Transform3D(turn, turn * Vector3(0.0, 0.0, 10.0))
		fire.sparks_shown = true
		await get_tree().process_frame
		await get_tree().process_frame
		var seen := []
		var places := []
		for i in fire._sparks.multimesh.visible_instance_count:
			var place: Vector3 = fire._sparks.multimesh.get_instance_transform(i).origin
			places.append([place.x, place.y, place.z])
			var at := eye.unproject_position(fire._sparks.to_global(place))
			seen.append([at.x, at.y])
		fire.sparks_shown = false
		var view: String = fire._sprite.animation
		steps.append({"view": view, "picture": await _picture(), "seen": seen, "places": places})
	var lamp: OmniLight3D = fire._lamp
	var place := [lamp.position.x, lamp.position.y, lamp.position.z]
	fire.lamp_energy = 3.0
	await get_tree().process_frame
	await get_tree().process_frame
	var answer := {"steps": steps, "lamp": place, "energy": lamp.light_energy}
	fire.free()
	eye.free()
	room.free()
	return answer


# Answers a picture of a FireAtlas3D at `time` from its front, and what the editor warns of.
func front(job: Dictionary) -> Array:
	var eye := Camera3D.new()
	eye.set_orthogonal(job["height"], 0.01, 100.0)
	eye.position.z = 10.0
	add_child(eye)
	eye.make_current()
	var fire := _fire("3d", job["scene"])
	fire.playing = false
	add_child(fire)
	fire.seek(job["time"])
	var answer := [await _picture(), fire._get_configuration_warnings()]
	fire.free()
	eye.free()
	return answer


# Tells a FireAtlas3D before each 1/60 s whether it is to burn, as `burning` says. Answers for each
# the animation and the frame that it shows, whether that is visible, how many sparks there are, the
# energy of its lamp, 0 without, and the signals that it has sent; and then how many nodes it left.
func light_in_space(job: Dictionary) -> Array:
	var fire := _fire("3d", job["scene"])
	fire.speed_scale = job["speed"]
	fire.burning = job["burning"][0]
	fire.lit.connect(func() -> void: _signals.append("lit"))
	fire.went_out.connect(func() -> void: _signals.append("went_out"))
	add_child(fire)
	var seen := []
	for burns: bool in job["burning"]:
		if burns:
			fire.ignite()
		else:
			fire.extinguish()
		await get_tree().process_frame
		var sparks: MultiMeshInstance3D = fire._sparks
		var shines: bool = fire._lamp != null and fire._lamp.visible
		seen.append([
			fire._sprite.animation, fire._sprite.frame, fire._sprite.visible,
			0 if sparks == null or not sparks.visible else sparks.multimesh.visible_instance_count,
			fire._lamp.light_energy if shines else 0.0, _signals.duplicate(),
		])
		_signals.clear()
	fire.fire = null
	await get_tree().process_frame
	fire.free()
	return [seen, Performance.get_monitor(Performance.OBJECT_ORPHAN_NODE_COUNT)]


# Plays a scene of a game, in which `action` is pressed once for each of `waits`; answers what its
# property `read` is when so many 1/60 s have passed.
func press(job: Dictionary) -> Array:
	var level: Node = load(job["scene"]).instantiate()
	add_child(level)
	var seen := []
	for waits: int in job["waits"]:
		var event := InputEventAction.new()
		event.action = job["action"]
		event.pressed = true
		Input.parse_input_event(event)
		for tick in waits:
			await get_tree().process_frame
		seen.append(level.get(job["read"]))
	level.free()
	return seen


func _fire(kind: String, scene: String) -> Node:
	var fire: Node = load(ADDON % kind).new()
	fire.fire = load(scene)
	fire.random_start = false
	fire.speed_spread = 0.0
	return fire


func _ground(colour: String) -> ColorRect:
	var ground := ColorRect.new()
	ground.size = get_viewport().get_visible_rect().size
	ground.color = Color(colour)
	add_child(ground)
	return ground


func _counts() -> Array:
	return [
		Performance.get_monitor(Performance.OBJECT_COUNT),
		Performance.get_monitor(Performance.OBJECT_RESOURCE_COUNT),
		Performance.get_monitor(Performance.OBJECT_NODE_COUNT),
		Performance.get_monitor(Performance.OBJECT_ORPHAN_NODE_COUNT),
	]


# This browser's software renderer, if it is busy, goes on drawing the custom data that a MultiMesh had
# when it was drawn first: what is drawn first must be what the sparks are now.
func _make_meshes_anew(fire: Node) -> void:
	for sparks: MultiMeshInstance2D in fire.find_children("*", "MultiMeshInstance2D", true, false):
		sparks.multimesh = sparks.multimesh.duplicate()


func _picture() -> String:
	await get_tree().process_frame
	await RenderingServer.frame_post_draw
	var image := get_viewport().get_texture().get_image()
	return Marshalls.raw_to_base64(image.save_png_to_buffer())
