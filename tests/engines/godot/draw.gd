# Draws scenes, each at a frame of an animation, and writes what the screen then shows.
# Job: {"at": [x, y], "background": "rrggbb", "shots": [{"scene", "animation", "frame", "to",
#       and perhaps "flakes": a time in frames at which they are shown}]}
extends "res://job.gd"


func run(job):
	VisualServer.set_default_clear_color(Color(job["background"]))
	for shot in job["shots"]:
		var node = load(shot["scene"]).instance()
		node.position = Vector2(job["at"][0], job["at"][1])
		get_root().add_child(node)
		node.play(shot["animation"])
		node.stop()
		node.frame = int(shot["frame"])
		if shot.has("alone"):
			node.self_modulate = Color(0, 0, 0, 0)
		if shot.has("flakes"):
			var flakes = node.get_node("Flakes")
			flakes.visible = true
			flakes.set_process(false)
			flakes.seek(shot["animation"], shot["flakes"])
		yield(self, "idle_frame")
		yield(VisualServer, "frame_post_draw")
		var image = get_root().get_texture().get_data()
		image.flip_y()
		image.save_png("res://" + shot["to"])
		node.free()
	answer(job["shots"].size())
