extends Node
# Does what the add-on does in the editor, but for running the command.

const ADDON := "res://addons/fire_atlas/%s.gd"

var Builder: GDScript = load(ADDON % "builder")
var Files: GDScript = load(ADDON % "files")
var Inputs: GDScript = load(ADDON % "inputs")


# Answers what the add-on reads of the `files` of a build, of what was `said` to it and in a depfile
# (`needs`).
func answer(job: Dictionary) -> Variant:
	DirAccess.make_dir_absolute("user://build")
	DirAccess.make_dir_absolute("user://imported")
	for file: String in job["files"]:
		Files.write_text("user://" + file, job["files"][file])
	return {
		"needs": Builder.read_depfile(job["needs"]),
		"events": job["said"].map(_events),
		"asset": _asset(job["recipe"]),
		"changes": _changes(),
		"kept_out": job["exported"].filter(_is_kept_out),
		"plugin": load(ADDON % "plugin").can_instantiate(),
	}


func _events(said: String) -> Array:
	var builder: RefCounted = Builder.new()
	builder.read_events(said, "the-command")
	return [builder.errors, builder.notes, builder.is_new]


# The asset as it plays, and which pictures are imported with it.
func _asset(recipe: String) -> Dictionary:
	var builder: RefCounted = Builder.new()
	builder._read_outputs("user://torch.d", recipe)
	builder.scene = builder.scene.replace("user://", "res://")
	var importer: Node = load(ADDON % "importer").new()
	Files.write_text("user://asset.tscn", importer._scene(builder))
	importer.free()
	var root: AnimatedSprite2D = load("user://asset.tscn").instantiate()
	var seen := {
		"root": root.name,
		"frames": root.sprite_frames.resource_path,
		"errors": builder.errors,
		"inputs": builder.inputs,
		"outputs": builder.outputs,
		"pictures": builder.pictures,
	}
	root.free()
	return seen


# What the add-on takes for changed: at once, when a file has changed that was there, and again;
# then if the recipe could not be built.
func _changes() -> Array:
	var inputs := PackedStringArray(["user://build/torch.json", "user://new.png"])
	var now := int(Time.get_unix_time_from_system())
	Files.write_text("user://torch.fire", "{}")
	Inputs.remember("user://imported/torch-1", "user://torch.fire", inputs, now + 60, false)
	var seen := [Inputs.find_changed("user://imported", false)]
	Files.write_text("user://new.png", "new")
	seen.append(Inputs.find_changed("user://imported", false))
	seen.append(Inputs.find_changed("user://imported", true))
	Inputs.remember("user://imported/torch-1", "user://torch.fire", inputs, now + 60, true)
	seen.append(Inputs.find_changed("user://imported", true))
	seen.append(Inputs.remembered("user://imported/torch-1"))
	DirAccess.remove_absolute("user://torch.fire")
	seen.append(Inputs.find_changed("user://imported", true))
	seen.append(FileAccess.file_exists("user://imported/torch-1.inputs.json"))
	return seen


func _is_kept_out(path: String) -> bool:
	ProjectSettings.set_setting("fire_atlas/export_json", path.begins_with("keep "))
	var exporter: Node = load(ADDON % "exporter").new()
	exporter._export_begin(PackedStringArray(), false, "", 0)
	exporter._export_file(path.trim_prefix("keep "), "", PackedStringArray())
	var is_skipped: bool = exporter.skipped > 0
	exporter.free()
	return is_skipped
