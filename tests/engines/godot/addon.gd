extends Node
# Does what the add-on does in the editor, but for running the command.

const ADDON := "res://addons/fire_atlas/%s.gd"
const COMMAND := "fire_atlas/command"
const RECIPE := "user://torch.fire"
const IMPORTED := "user://.godot/imported"

var Builder: GDScript = load(ADDON % "builder")
var Editor: GDScript = load("res://editor.gd")
var Files: GDScript = load(ADDON % "files")
var Inputs: GDScript = load(ADDON % "inputs")
var Program: GDScript = load(ADDON % "program")


# Answers what the add-on does with the `files` of a build, and reads of what was `said` to it and in
# a depfile (`needs`).
func answer(job: Dictionary) -> Variant:
	for folder: String in [IMPORTED, "user://build", "user://clip", "user://chosen"]:
		DirAccess.make_dir_recursive_absolute(folder)
	for file: String in job["files"]:
		var text: String = job["files"][file]
		Files.write_text("user://" + file, text.replace("RECIPE", ProjectSettings.globalize_path(RECIPE)))
	return {
		"needs": Builder.read_depfile(job["needs"]),
		"events": job["said"].map(_events),
		"programs": _programs(job["disk"], job["programs"]),
		"imported": await _imported(),
		"changes": _changes(),
		"kept_out": job["exported"].filter(_is_kept_out),
	}


func _events(said: String) -> Array:
	var builder: RefCounted = Builder.new()
	builder.read_events(said, "the-command")
	return [builder.errors, builder.notes, builder.is_new]


# Which program is found, for each command, PATH, project and whether the system is Windows; with
# empty files on the disk.
func _programs(disk: Array, asked: Array) -> Array:
	for path: String in disk:
		DirAccess.make_dir_recursive_absolute(path.get_base_dir())
		Files.write_text(path, "")
	return asked.map(func(each: Array) -> String: return Program.callv("find", each))


# What the editor is told to do as a recipe is imported, and as one of its inputs goes; the asset.
func _imported() -> Dictionary:
	Editor.editor = Editor.new()
	Editor.editor.users_settings[COMMAND] = "\"/chosen/fire-atlas\" "
	for setting: String in [COMMAND, "editor_overrides/" + COMMAND]:
		ProjectSettings.set_setting(setting, "/planted/fire-atlas")
	var plugin: Node = load(ADDON % "plugin").new()
	add_child(plugin)
	while fmod(Time.get_unix_time_from_system(), 1.0) > 0.5:
		OS.delay_msec(50)
	Files.write_text("user://clip/1.png", "a frame of the second in which the build begins")
	var none: Array[String] = []
	var generated: Array[String] = []
	var path := IMPORTED + "/torch"
	var error: Error = Editor.importer._import(RECIPE, path, {}, none, generated)
	for i in 3:
		if i == 2:
			DirAccess.remove_absolute("user://clip/0.png")
		Editor.editor.filesystem_changed.emit()
		await get_tree().process_frame
	remove_child(plugin)
	plugin.free()
	Editor.editor.free()
	var inputs: PackedStringArray = Inputs.remembered(path)
	DirAccess.remove_absolute(path + Inputs.ENDING)
	return {
		"calls": Editor.calls,
		"error": error,
		"generated": generated,
		"inputs": inputs,
		"asset": _asset(Files.read_text(path + ".tscn")),
	}


func _asset(text: String) -> Array:
	Files.write_text("user://asset.tscn", text.replace("user://build", "res://build"))
	var root: AnimatedSprite2D = load("user://asset.tscn").instantiate()
	var seen := [root.name, root.sprite_frames.resource_path]
	root.free()
	return seen


# What the add-on takes for changed: at once, when a file has come that was not there, and again;
# if the recipe could not be built; if the recipe has gone.
func _changes() -> Array:
	var path := IMPORTED + "/torch"
	var inputs := PackedStringArray(["user://build/torch.json", "user://new.png"])
	var now := int(Time.get_unix_time_from_system())
	Inputs.remember(path, RECIPE, inputs, now + 60, false)
	var seen := [Inputs.find_changed(IMPORTED, false)]
	Files.write_text("user://new.png", "new")
	seen.append(Inputs.find_changed(IMPORTED, false))
	seen.append(Inputs.find_changed(IMPORTED, true))
	Inputs.remember(path, RECIPE, inputs, now + 60, true)
	seen.append(Inputs.find_changed(IMPORTED, true))
	DirAccess.remove_absolute(RECIPE)
	seen.append(Inputs.find_changed(IMPORTED, true))
	seen.append(Files.names_in(IMPORTED))
	return seen


func _is_kept_out(path: String) -> bool:
	ProjectSettings.set_setting("fire_atlas/export_json", path.begins_with("keep "))
	var exporter: Node = load(ADDON % "exporter").new()
	exporter._export_begin(PackedStringArray(), false, "", 0)
	exporter._export_file(path.trim_prefix("keep "), "", PackedStringArray())
	var is_skipped: bool = exporter.skipped > 0
	exporter.free()
	return is_skipped
