extends Node
# Places a fire several times, as a level does, and tells how each begins.


# Answers for each of `count` fires what it shows when it has begun: of each of its parts that is
# asked for, `read`, the value. A `kind` is a node of the add-on, which plays the scene.
func answer(job: Dictionary) -> Array:
	if job.has("put_out"):
		return await _put_out(job)
	var fires := []
	for i in int(job["count"]):
		var scene: PackedScene = load(job["scene"])
		var fire: Node = scene.instantiate()
		if job.has("kind"):
			fire.free()
			fire = load("res://addons/fire_atlas/fire_atlas_%s.gd" % job["kind"]).new()
			fire.fire = scene
		for property: String in job.get("set", {}):
			var owner_of: Node = fire if job.has("kind") else _sprite(fire)
			owner_of.set(property, job["set"][property])
		add_child(fire)
		fires.append(fire)
	await get_tree().process_frame
	var seen := []
	for fire: Node in fires:
		seen.append(_read(_sprite(fire)))
		seen[-1]["mirrored"] = fire is Node2D and _whole(fire).scale.x < 0.0
		fire.free()
	return seen


# The animations that a fire shows, which is put out and then lit.
func _put_out(job: Dictionary) -> Array:
	var fire: Node = load(job["scene"]).instantiate()
	for property: String in job["set"]:
		fire.set(property, job["set"][property])
	add_child(fire)
	await get_tree().process_frame
	var shown := [fire.animation]
	fire.extinguish()
	for tick in 90:
		await get_tree().process_frame
		if fire._is_out:
			fire.ignite()
		if fire.animation != shown[-1]:
			shown.append(fire.animation)
	fire.free()
	return shown


# The node that is turned round to mirror a fire.
func _whole(fire: Node2D) -> Node2D:
	return fire._parts.root if "sparks_shown" in fire else fire


# The moment that is shown, the speed, the energy of the lamp, and how many sparks there are.
func _read(shown: Node) -> Dictionary:
	var lamp: Node = shown.get_node_or_null("Light")
	var sparks: Node = shown.get_node_or_null("Flakes")
	var told := {
		"lamp": 0.0 if lamp == null else lamp.energy,
		"sparks": 0 if sparks == null else sparks.multimesh.visible_instance_count,
	}
	for flown: Node in [sparks, shown]:
		if flown != null and "flake_set" in flown:
			told["set"] = flown._own_set
	if shown is AnimatedSprite2D or shown is AnimatedSprite3D:
		told["time"] = shown.frame + shown.frame_progress
		told["speed"] = shown.speed_scale
		told["animation"] = shown.animation
	elif shown is MultiMeshInstance3D:
		told["time"] = shown._time
		told["speed"] = shown._pace
		told["animation"] = shown.animation
	else:
		told["time"] = shown.material.get_shader_parameter("frame")
		told["speed"] = shown.get_node("Player").speed_scale
	return told


# What plays the flame of a fire: itself, a part of its scene, or of a node of the add-on.
func _sprite(fire: Node) -> Node:
	if "sparks_shown" in fire:
		return fire._parts.sprite if fire is Node2D else fire._player()
	return fire.get_node("Film/Fire") if fire.has_node("Film/Fire") else fire
