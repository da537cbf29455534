extends Node
# Does the jobs of a test, jobs.json, one after the other, and reports each answer to the page.


func _ready() -> void:
	await get_tree().process_frame
	for job: Dictionary in JSON.parse_string(FileAccess.get_file_as_string("res://jobs.json")):
		_report("answer", JSON.stringify(await call(job["do"], job)))
	_report("done", "")


func _report(kind: String, text: String) -> void:
	JavaScriptBridge.eval("report('%s', %s)" % [kind, JSON.stringify(text)])


# Answers what a `script` of the project does, a Node with a function `answer(job)`.
func ask(job: Dictionary) -> Variant:
	var asked: Node = load(job["script"]).new()
	add_child(asked)
	var answer: Variant = await asked.answer(job)
	asked.free()
	return answer


# Answers what the engine understood of the SpriteFrames at `path`.
func describe_frames(job: Dictionary) -> Dictionary:
	var frames: SpriteFrames = load(job["path"])
	var animations := {}
	for title in frames.get_animation_names():
		var shown := []
		for i in frames.get_frame_count(title):
			var texture: AtlasTexture = frames.get_frame_texture(title, i)
			shown.append({
				"region": _numbers(texture.region),
				"margin": _numbers(texture.margin),
				"size": [texture.get_width(), texture.get_height()],
				"page": texture.atlas.resource_path,
				"page_size": [texture.atlas.get_width(), texture.atlas.get_height()],
				"duration": frames.get_frame_duration(title, i),
			})
		animations[title] = {
			"frames": shown,
			"speed": frames.get_animation_speed(title),
			"loop": frames.get_animation_loop(title),
		}
	return animations


# Answers what the engine understood of the textures and boxes at `paths`, and the pixels of those.
func describe_sprites(job: Dictionary) -> Dictionary:
	var seen := {}
	var pages := {}  # read back once: AtlasTexture.get_image() does so for each, and cuts its region
	for path: String in job["paths"]:
		var found: Resource = load(path)
		if found is StyleBoxTexture:
			seen[path] = {
				"name": found.resource_name,
				"region": _numbers(found.region_rect),
				"margins": [SIDE_LEFT, SIDE_TOP, SIDE_RIGHT, SIDE_BOTTOM].map(
					func(side: Side) -> float: return found.get_texture_margin(side)
				),
			}
			continue
		var texture: AtlasTexture = found
		if not pages.has(texture.atlas):
			pages[texture.atlas] = texture.atlas.get_image()
		var image: Image = pages[texture.atlas].get_region(texture.region)
		seen[path] = {
			"name": texture.resource_name,
			"region": _numbers(texture.region),
			"margin": _numbers(texture.margin),
			"size": [texture.get_width(), texture.get_height()],
			"png": Marshalls.raw_to_base64(image.save_png_to_buffer()),
		}
	return seen


# Answers properties of the nodes of `scene`, {"Flakes:visible": ..., ":offset": ...}, when it has
# played for `ticks` of 1/60 s.
func read(job: Dictionary) -> Dictionary:
	var node := _staged(job)
	for tick in int(job.get("ticks", 1)) + 1:
		await get_tree().process_frame
	var seen := {}
	for path: String in job["read"]:
		seen[path] = _numbers(_node(node, path).get_indexed(_property(path)))
	_clear(node)
	return seen


# Answers a picture of the window that shows `scene` before a ground, which lamps light.
func draw(job: Dictionary) -> String:
	var ground := ColorRect.new()
	ground.size = get_viewport().get_visible_rect().size
	ground.color = Color(job["background"])
	add_child(ground)
	var node := _staged(job)
	await get_tree().process_frame
	await RenderingServer.frame_post_draw
	var image := get_viewport().get_texture().get_image()
	ground.free()
	_clear(node)
	return Marshalls.raw_to_base64(image.save_png_to_buffer())


# Answers where the flakes of `scene` are at each of `times`, in frames of `animation`.
func seek_flakes(job: Dictionary) -> Array:
	var node := _staged(job)
	var flakes := node.get_node("Flakes")
	flakes.set_process(false)
	var seen := []
	for time: float in job["times"]:
		flakes.seek(job["animation"], time)
		seen.append(_flakes(flakes))
	_clear(node)
	return seen


# Answers where a camera in space sees the flakes of `scene`, x and y in px, at each of `times`, in
# frames of `animation`; or a picture of what it sees last.
func see_flakes(job: Dictionary) -> Variant:
	var flakes: MultiMeshInstance3D = load(job["scene"]).instantiate()
	flakes.playing = false
	_begin_together(flakes)
	add_child(flakes)
	var eye := Camera3D.new()
	eye.far = 1000.0
	if job["distance"] == null:
		eye.set_orthogonal(job["height"], 0.01, 1000.0)
	else:
		eye.fov = rad_to_deg(2.0 * atan(job["height"] / 2.0 / job["distance"]))
	var turn := Basis.from_euler(Vector3(-job["elevation"], job["azimuth"], 0.0))
	var away: float = 100.0 if job["distance"] == null else job["distance"]
	eye.transform = Transform3D(turn, turn * Vector3(0.0, job["raised"], away))
	add_child(eye)
	eye.make_current()
	await get_tree().process_frame
	var seen := []
	for time: float in job["times"]:
		flakes.seek(job["animation"], time)
		var places := []
		for i in flakes.multimesh.visible_instance_count:
			var place := flakes.multimesh.get_instance_transform(i).origin
			places.append(_numbers(eye.unproject_position(flakes.to_global(place))))
		seen.append(places)
	if job.get("picture", false):
		await get_tree().process_frame
		await RenderingServer.frame_post_draw
		var image := get_viewport().get_texture().get_image()
		seen = [Marshalls.raw_to_base64(image.save_png_to_buffer())]
	flakes.free()
	eye.free()
	return seen


# Answers how the lamp of `scene` shines at each of `times`: energy, colour, place.
func seek_light(job: Dictionary) -> Array:
	var node := _staged(job)
	var light: PointLight2D = node.get_node("Light")
	light.set_process(false)
	var seen := []
	for time: float in job["times"]:
		light.seek(job["animation"], time)
		seen.append([light.energy] + _numbers(light.color) + _numbers(light.position))
	_clear(node)
	return seen


# Answers the properties of each node of `scene` that the editor would save.
func saved(job: Dictionary) -> Dictionary:
	var node := _staged(job)
	await get_tree().process_frame
	var packed := PackedScene.new()
	packed.pack(node)
	_clear(node)
	var state := packed.get_state()
	var properties := {}
	for i in state.get_node_count():
		properties[state.get_node_name(i)] = range(state.get_node_property_count(i)).map(
			func(j: int) -> StringName: return state.get_node_property_name(i, j)
		)
	return properties


# Plays `scene` for `ticks` of 1/60 s; answers for each its time in frames and where its flakes are.
func play(job: Dictionary) -> Array:
	var node := _staged(job)
	var seen := []
	for tick in int(job["ticks"]):
		await get_tree().process_frame
		seen.append([node.frame + node.frame_progress, _flakes(node.get_node_or_null("Flakes"))])
	_clear(node)
	return seen


# Plays `scene`, a fire in several winds; answers after each 1/60 s its animation, its frame and the
# region of the page that it shows. `winds` is what blows from each 1/60 s on.
func change_wind(job: Dictionary) -> Array:
	var node: AnimatedSprite2D = _staged(job)
	var seen := []
	for wind: float in job["winds"]:
		node.wind = wind
		await get_tree().process_frame
		var texture: AtlasTexture = node.sprite_frames.get_frame_texture(node.animation, node.frame)
		seen.append([node.animation, node.frame, _numbers(texture.region)])
	_clear(node)
	return seen


# Plays `scene`, a fire that is lit and put out, and tells it before each 1/60 s whether it is to burn,
# as `burning` says. Answers after each its animation, its frame, the part of that which has passed,
# whether it is visible, the signals that it has sent, the energy of its lamp, and its flakes.
func light_and_put_out(job: Dictionary) -> Array:
	var node: AnimatedSprite2D = _staged(job)
	var sent := []
	node.lit.connect(func() -> void: sent.append("lit"))
	node.went_out.connect(func() -> void: sent.append("went_out"))
	var lamp := node.get_node_or_null("Light") as PointLight2D
	var seen := []
	for burns: bool in job["burning"]:
		if burns:
			node.ignite()
		else:
			node.extinguish()
		await get_tree().process_frame
		var energy := 0.0 if lamp == null else lamp.energy
		var shown := [node.animation, node.frame, node.frame_progress, node.visible]
		seen.append(shown + [sent.duplicate(), energy, _flakes(node.get_node_or_null("Flakes"))])
		sent.clear()
	_clear(node)
	return seen


# Stages `scene` in a level as the job says: where and how large (`at`, `zoom`), at a `frame` of an
# `animation` of its `sprite`, with properties set to what texts say ({":modulate": "Color(1, 1, 1, 0.5)"}).
func _staged(job: Dictionary) -> Node2D:
	var node: Node2D = load(job["scene"]).instantiate()
	var at: Array = job.get("at", [0, 0])
	node.position = Vector2(at[0], at[1])
	node.scale *= job.get("zoom", 1)
	if not job.get("apart", false):
		_begin_together(node)
	var level := Node2D.new()
	level.add_child(node)
	add_child(level)
	if job.has("frame"):
		var sprite: AnimatedSprite2D = node.get_node(job.get("sprite", "."))
		sprite.stop()
		sprite.animation = job["animation"]
		sprite.frame = job["frame"]
	var changes: Dictionary = job.get("set", {})
	for path: String in changes:
		_node(node, path).set_indexed(_property(path), str_to_var(changes[path]))
	return node


# Lets a loop begin with its first frame, at its own speed.
func _begin_together(node: Node) -> void:
	for each: Node in [node] + node.find_children("*"):
		if "random_start" in each:
			each.random_start = false
			each.speed_spread = 0.0


func _clear(node: Node2D) -> void:
	node.get_parent().free()


# The node that a path like "Flakes:scale" begins with, and the property that it ends with.
func _node(root: Node, path: String) -> Node:
	return root if path.begins_with(":") else root.get_node(path.get_slice(":", 0))


func _property(path: String) -> NodePath:
	return NodePath(path.substr(path.find(":")))


# Rows of place x, y, length, width, rotation, light r, g, b, hard.
func _flakes(node: MultiMeshInstance2D) -> Array:
	var rows := []
	var count := 0 if node == null else node.multimesh.visible_instance_count
	for i in count:
		var at := node.multimesh.get_instance_transform_2d(i)
		var size := [at.x.length(), at.y.length(), at.x.angle()]
		rows.append(_numbers(at.origin) + size + _numbers(node.multimesh.get_instance_custom_data(i)))
	return rows


# A value as JSON can hold it.
func _numbers(value: Variant) -> Variant:
	match typeof(value):
		TYPE_VECTOR2:
			return [value.x, value.y]
		TYPE_RECT2:
			return _numbers(value.position) + _numbers(value.size)
		TYPE_COLOR:
			return [value.r, value.g, value.b, value.a]
		TYPE_OBJECT:
			return value.resource_path if value is Resource else null
	return value
