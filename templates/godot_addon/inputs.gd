@tool
extends RefCounted
# Remembers what each recipe was built from, and when that was changed; the editor itself looks only
# at the recipes. It is a file for each recipe, beside the imported asset.
# Written by `fire-atlas plugin godot`, which writes it anew.

const Files = preload("files.gd")

const ENDING: String = ".inputs.json"


# Remembers the files and folders that a recipe was built from.
# `began` is when the build began: it may lack what was changed since.
static func remember(
	save_path: String, recipe: String, inputs: PackedStringArray, began: int, has_failed: bool
) -> void:
	var times: Dictionary = {}
	for path in inputs:
		var time: int = Files.changed_at(path)
		times[path] = time if time < began else -1
	_write(save_path + ENDING, {"recipe": recipe, "failed": has_failed, "times": times})


# Returns what a recipe was built from the last time.
static func remembered(save_path: String) -> PackedStringArray:
	var entry: Dictionary = Files.parsed(Files.read_text(save_path + ENDING))
	return PackedStringArray(entry.get("times", {}).keys())


# Returns where in a folder the assets of those recipes are saved whose inputs have changed, by the
# recipe's path. Each change is returned once. `with_failed` adds recipes that could not be built
# the last time.
static func find_changed(folder: String, with_failed: bool) -> Dictionary:
	var recipes: Dictionary = {}
	for name in Files.names_in(folder):
		if not name.ends_with(ENDING):
			continue
		var path: String = folder + "/" + name
		var entry: Dictionary = Files.parsed(Files.read_text(path))
		var recipe: String = entry.get("recipe", "")
		if Files.changed_at(recipe) == 0:
			Files.remove(path)
			continue
		var is_changed: bool = with_failed and entry["failed"]
		var times: Dictionary = entry["times"]
		for input in times.keys():
			var time: int = Files.changed_at(input)
			is_changed = is_changed or time != int(times[input])
			times[input] = time
		if is_changed:
			recipes[recipe] = path.trim_suffix(ENDING)
			_write(path, entry)
	return recipes


# Returns the folder in which the editor keeps what it has imported.
static func imported() -> String:
	var setting: String = "application/config/use_hidden_project_data_directory"
	var is_shown: bool = (
		ProjectSettings.has_setting(setting) and not ProjectSettings.get_setting(setting)
	)
	return "res://" + ("" if is_shown else ".") + "godot/imported"


static func _write(path: String, entry: Dictionary) -> void:
	if not Files.write_text(path, JSON.stringify(entry)):
		push_error("%s cannot be written, so changes of inputs are not seen" % path)
