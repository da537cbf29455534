# Answers how the lamp shines at given times in frames.
# Job: {"scene", "animation", "times": [...]}
extends "res://job.gd"


func run(job):
	var node = load(job["scene"]).instance()
	get_root().add_child(node)
	var lamp = node.get_node("Light")
	lamp.set_process(false)
	yield(self, "idle_frame")
	var seen = []
	for time in job["times"]:
		lamp.seek(job["animation"], time)
		var tint = lamp.color
		var at = lamp.position
		seen.append([lamp.energy, tint.r, tint.g, tint.b, at.x, at.y])
	answer({"seen": seen})
