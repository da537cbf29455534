# Answers what the engine understood of each resource and scene of the job, by their paths.
extends "res://job.gd"


func run(job):
	var told = {}
	for path in job:
		var loaded = ResourceLoader.load(path, "", true)
		if loaded is SpriteFrames:
			told[path] = _frames(loaded)
		elif loaded is PackedScene:
			told[path] = _scene(loaded.instance())
		else:
			told[path] = null
	answer(told)


func _frames(frames):
	var animations = {}
	for name in frames.get_animation_names():
		var shown = []
		for i in range(frames.get_frame_count(name)):
			var texture = frames.get_frame(name, i)
			shown.append({
				"region": _rect(texture.region),
				"margin": _rect(texture.margin),
				"size": [texture.get_width(), texture.get_height()],
				"page": texture.atlas.resource_path if texture.atlas else "",
				"page_size": [texture.atlas.get_width(), texture.atlas.get_height()],
			})
		animations[name] = {
			"frames": shown,
			"speed": frames.get_animation_speed(name),
			"loop": frames.get_animation_loop(name),
		}
	return animations


func _scene(node):
	var flakes = node.get_node_or_null("Flakes")
	var told = {
		"name": node.name,
		"type": node.get_class(),
		"animation": node.animation,
		"playing": node.playing,
		"offset": [node.offset.x, node.offset.y],
		"centered": node.centered,
		"blend": node.material.blend_mode if node.material else 0,
		"frames": node.frames.resource_path,
		"flakes": null,
	}
	if flakes:
		told["flakes"] = {
			"visible": flakes.visible,
			"scale": [flakes.scale.x, flakes.scale.y],
			"rows": flakes.tracks.rows.size() / flakes.STRIDE,
			"animations": Array(flakes.tracks.animations),
		}
	node.free()
	return told


func _rect(rect):
	return [rect.position.x, rect.position.y, rect.size.x, rect.size.y]
