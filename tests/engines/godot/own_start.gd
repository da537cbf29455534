extends Node
# Places a fire several times, as a level does, and tells how each begins.


# Answers for each of `count` fires what it shows when it has begun: of each of its parts that is
# asked for, `read`, the value. A `kind` is a node of the add-on, which plays the scene.
func answer(job: Dictionary) -> Array:
	var fires := []
	for i in int(job["count"]):
		var scene: PackedScene = load(job["scene"])
		var fire: Node = scene.instantiate()
		if job.has("kind"):
			fire.free()
			fire = load("res://addons/fire_atlas/fire_atlas_%s.gd" % job["kind"]).new()
			fire.fire = scene
		for property: String in job.get("set", {}):
			fire.set(property, job["set"][property])
		add_child(fire)
		fires.append(fire)
	await get_tree().process_frame
	var seen := []
	for fire: Node in fires:
		seen.append(_read(_sprite(fire)))
		fire.free()
	return seen


# The moment that is shown, the speed, the energy of the lamp, and how many sparks there are.
func _read(shown: Node) -> Dictionary:
	var lamp: Node = shown.get_node_or_null("Light")
	var sparks: Node = shown.get_node_or_null("Flakes")
	var told := {
		"lamp": 0.0 if lamp == null else lamp.energy,
		"sparks": 0 if sparks == null else sparks.multimesh.visible_instance_count,
	}
	if shown is AnimatedSprite2D or shown is AnimatedSprite3D:
		told["time"] = shown.frame + shown.frame_progress
		told["speed"] = shown.speed_scale
		told["animation"] = shown.animation
	elif shown is MultiMeshInstance3D:
		told["time"] = shown._time
		told["speed"] = shown._pace
	else:
		told["time"] = shown.material.get_shader_parameter("frame")
		told["speed"] = shown.get_node("Player").speed_scale
	return told


# What plays the flame of a fire: itself, a part of its scene, or of a node of the add-on.
func _sprite(fire: Node) -> Node:
	if "sparks_shown" in fire:
		return fire._parts.sprite if fire is Node2D else fire._player()
	return fire.get_node("Film/Fire") if fire.has_node("Film/Fire") else fire
