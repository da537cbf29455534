# Answers where the player puts flakes: at given times in frames, and while the sprite plays.
# Job: {"scene", "animation", "times": [...], "frames": [...]}
extends SceneTree

var _job


func _init():
	var file = File.new()
	file.open("res://job.json", File.READ)
	_job = parse_json(file.get_as_text())
	file.close()
	call_deferred("_fly")


func _fly():
	var node = load(_job["scene"]).instance()
	get_root().add_child(node)
	var flakes = node.get_node("Flakes")
	flakes.visible = true
	flakes.set_process(false)
	yield(self, "idle_frame")
	var sought = []
	for time in _job["times"]:
		flakes.seek(_job["animation"], time)
		sought.append(_seen(flakes.multimesh))
	flakes.set_process(true)
	node.play(_job["animation"])
	node.stop()
	var followed = []
	for frame in _job["frames"]:
		node.frame = int(frame)
		yield(self, "idle_frame")
		yield(self, "idle_frame")
		followed.append(_seen(flakes.multimesh))
	flakes.visible = false
	flakes.multimesh.visible_instance_count = 0
	node.frame = int(_job["frames"][0])
	yield(self, "idle_frame")
	yield(self, "idle_frame")
	var file = File.new()
	file.open("res://answer.json", File.WRITE)
	file.store_string(to_json({
		"sought": sought, "followed": followed, "hidden": _seen(flakes.multimesh)
	}))
	file.close()
	quit()


# Rows of place x, y, length, width, turn, light r, g, b, hard.
func _seen(multimesh):
	var rows = []
	for i in range(multimesh.visible_instance_count):
		var at = multimesh.get_instance_transform_2d(i)
		var light = multimesh.get_instance_custom_data(i)
		rows.append([
			at.origin.x, at.origin.y, at.x.length(), at.y.length(), at.x.angle(),
			light.r, light.g, light.b, light.a,
		])
	return rows
