extends Node
# Watches a scene of particles that stay where they are born, each drawn as a square of one colour.

# What the colour of a square tells of its particle: its light x as x / (1 + x), or its width.
const SHADER := "shader_type canvas_item;
render_mode unshaded;
uniform float side;
uniform bool tells_width;
varying flat vec3 told;

void vertex() {
	float width = length(MODEL_MATRIX[0].xy);
	VERTEX *= side / width;
	told = tells_width ? vec3(width / 16.0) : COLOR.rgb / (1.0 + COLOR.rgb);
}

void fragment() {
	COLOR = vec4(told, 1.0);
}
"


# Answers pictures of the particles of `scene`, `seconds` apart: `count` of their light and one of their
# width. `side` is that of the squares, px; `amount` of particles, if not the scene's own.
func answer(job: Dictionary) -> Array:
	var sparks: GPUParticles2D = load(job["scene"]).instantiate()
	var window := get_viewport().get_visible_rect().size
	var ground := ColorRect.new()
	ground.size = window
	ground.color = Color(0.0, 0.0, 1.0)
	add_child(ground)
	var process: ParticleProcessMaterial = sparks.process_material
	process.emission_shape_offset = Vector3(window.x, window.y, 0.0) / 2.0
	process.emission_box_extents = process.emission_shape_offset - Vector3(4.0, 4.0, 0.0)
	process.initial_velocity_min = 0.0
	process.initial_velocity_max = 0.0
	process.gravity = Vector3.ZERO
	process.particle_flag_align_y = false
	sparks.amount = job.get("amount", sparks.amount)
	sparks.visibility_rect = Rect2(Vector2.ZERO, window)
	sparks.use_fixed_seed = true
	sparks.seed = 5
	var material := ShaderMaterial.new()
	material.shader = Shader.new()
	material.shader.code = SHADER
	material.set_shader_parameter("side", job["side"])
	sparks.material = material
	add_child(sparks)
	var seen := []
	Engine.time_scale = job["seconds"] * 60.0  # a picture every tick
	for i in int(job["count"]) + 1:
		material.set_shader_parameter("tells_width", i == int(job["count"]))
		await RenderingServer.frame_post_draw
		var image := get_viewport().get_texture().get_image()
		seen.append(Marshalls.raw_to_base64(image.save_png_to_buffer()))
	Engine.time_scale = 1.0
	sparks.free()
	ground.free()
	return seen
