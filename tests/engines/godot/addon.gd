extends Node
# Does what the add-on does in the editor. What the command says is read from a file.

const ADDON := "res://addons/fire_atlas/%s.gd"
const COMMAND := "fire_atlas/command"
const RECIPE := "user://torch.fire"
const IMPORTED := "user://.godot/imported"

var Builder: GDScript = load(ADDON % "builder")
var Editor: GDScript = load("res://editor.gd")
var Files: GDScript = load(ADDON % "files")
var Inputs: GDScript = load(ADDON % "inputs")
var Program: GDScript = load(ADDON % "program")

var _plugin: Node


# Answers what the add-on does with the `files` of a build, and reads of what was `said` to it and in
# a depfile (`needs`).
func answer(job: Dictionary) -> Variant:
	for file: String in job["files"]:
		DirAccess.make_dir_recursive_absolute(("user://" + file).get_base_dir())
		var text: String = job["files"][file]
		Files.write_text("user://" + file, text.replace("USERS/", ProjectSettings.globalize_path("user://")))
	return {
		"needs": Builder.read_depfile(job["needs"]),
		"events": job["said"].map(_events),
		"programs": _programs(job["disk"], job["programs"]),
		"imported": await _imported(),
		"failed": await _failed(),
		"named": job["paths"].map(_run_of),
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


# Opens the editor of a user who has named the command, or not; a project names one too.
func _open(command: String) -> void:
	Editor.calls = []
	Editor.editor = Editor.new()
	if command != "":
		Editor.editor.users_settings[COMMAND] = command
	for setting: String in [COMMAND, "editor_overrides/" + COMMAND]:
		ProjectSettings.set_setting(setting, "/planted/fire-atlas")
	_plugin = load(ADDON % "plugin").new()
	add_child(_plugin)


func _close() -> Array:
	remove_child(_plugin)
	_plugin.free()
	Editor.editor.free()
	return Editor.calls


# Imports a recipe; adds the files of its build to `generated`.
func _import(recipe: String, generated: Array[String]) -> Error:
	var none: Array[String] = []
	var path: String = IMPORTED + "/" + recipe.get_file().get_basename()
	return Editor.importer._import(recipe, path, {}, none, generated)


# Tells the editor that files have changed, and waits until the add-on has looked at them.
func _look() -> void:
	Editor.editor.filesystem_changed.emit()
	await get_tree().process_frame


# What the editor is told to do as a recipe is imported, and as its inputs go, one by one: while the
# editor imports other files, and before the user comes back to it; the asset.
func _imported() -> Dictionary:
	_open("\"/chosen/fire-atlas\" ")
	while fmod(Time.get_unix_time_from_system(), 1.0) > 0.5:
		OS.delay_msec(50)
	Files.write_text("user://clip/1.png", "a frame of the second in which the build begins")
	var generated: Array[String] = []
	var error: Error = _import(RECIPE, generated)
	await _look()
	await _look()
	Editor.editor.resources_reimporting.emit(PackedStringArray())
	DirAccess.remove_absolute("user://clip/0.png")
	await _look()
	Editor.calls.append(["no more imports", ""])
	Editor.editor.resources_reimported.emit(PackedStringArray())
	await get_tree().process_frame
	DirAccess.remove_absolute("user://clip/2.png")
	_plugin.notification(NOTIFICATION_APPLICATION_FOCUS_IN)
	await get_tree().process_frame
	var path := IMPORTED + "/torch"
	var inputs: PackedStringArray = Inputs.remembered(path)
	DirAccess.remove_absolute(path + Inputs.ENDING)
	return {
		"calls": _close(),
		"error": error,
		"generated": generated,
		"inputs": inputs,
		"asset": _asset(Files.read_text(path + ".tscn")),
		"text": Files.read_text(path + ".tscn"),
	}


# What the editor is told of recipes that cannot be built, what it tries again once it is started
# anew, and what is left then; the asset of the one that was built before stays.
func _failed() -> Dictionary:
	var asset: String = Files.read_text(IMPORTED + "/torch.tscn")
	var generated: Array[String] = []
	var errors := {}
	_open("/chosen/fire-atlas")
	for recipe: String in ["user://typo.fire", "user://other.fire"]:
		errors[recipe] = _import(recipe, generated)
	Editor.editor.users_settings[COMMAND] = "/nowhere/fire-atlas"
	errors[RECIPE] = _import(RECIPE, generated)
	await _look()
	var first := _close()
	_open("/chosen/fire-atlas")
	await _look()
	errors["again"] = _import(RECIPE, generated)
	Inputs.find_changed(IMPORTED, true)  # each change is told once, each failure as often as asked
	var left: Dictionary = Inputs.find_changed(IMPORTED, true)
	var second := _close()
	for recipe: String in left:
		DirAccess.remove_absolute(left[recipe] + Inputs.ENDING)
	DirAccess.remove_absolute(IMPORTED + "/torch" + Inputs.ENDING)
	return {
		"errors": errors,
		"calls": first,
		"calls after a restart": second,
		"left": left.keys(),
		"asset stays": Files.read_text(IMPORTED + "/torch.tscn") == asset,
	}


# What is run, or said, where the user has named no command, for the system's PATH.
func _run_of(path: String) -> Array:
	var generated: Array[String] = []
	OS.set_environment("PATH", path)
	_open("")
	_import(RECIPE, generated)
	var calls := _close().filter(func(call: Array) -> bool: return call[0] in ["run", "error"])
	DirAccess.remove_absolute(IMPORTED + "/torch" + Inputs.ENDING)
	return calls[0]


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
