# Answers where the player puts flakes: at given times in frames, while the sprite is set to frames,
# and while it plays for `ticks` of 1/60 s, with its frame.
# Job: {"scene", "animation", "times": [...], "frames": [...], "ticks"}
extends "res://job.gd"


func run(job):
	var node = load(job["scene"]).instance()
	get_root().add_child(node)
	var flakes = node.get_node("Flakes")
	flakes.visible = true
	flakes.set_process(false)
	yield(self, "idle_frame")
	var sought = []
	for time in job["times"]:
		flakes.seek(job["animation"], time)
		sought.append(_seen(flakes.multimesh))
	flakes.set_process(true)
	node.play(job["animation"])
	node.stop()
	var followed = []
	for frame in job["frames"]:
		node.frame = int(frame)
		yield(self, "idle_frame")
		yield(self, "idle_frame")
		followed.append(_seen(flakes.multimesh))
	node.frame = 0
	node.play(job["animation"])
	var played = []
	for _tick in range(job["ticks"]):
		yield(self, "idle_frame")
		played.append([node.frame, _seen(flakes.multimesh)])
	node.stop()
	flakes.visible = false
	flakes.multimesh.visible_instance_count = 0
	node.frame = int(job["frames"][0])
	yield(self, "idle_frame")
	yield(self, "idle_frame")
	answer({
		"sought": sought, "followed": followed, "played": played, "hidden": _seen(flakes.multimesh)
	})


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
