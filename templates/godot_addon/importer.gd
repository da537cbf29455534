@tool
extends EditorImportPlugin
# Imports a recipe (*.fire): builds it by the command `fire-atlas` into build/ beside it. The asset
# is a scene that inherits the one which the build has written.
# Written by `fire-atlas plugin godot`, which writes it anew.

const Builder = preload("builder.gd")
const Files = preload("files.gd")
const Inputs = preload("inputs.gd")
const Program = preload("program.gd")

# The editor's list of files, and the user's settings.
var filesystem: EditorFileSystem
var settings: EditorSettings
# Whether builds have written files that the editor may not have seen yet.
var has_built: bool = false
# When recipes were changed and tried that could not be built since the editor was started.
var failed: Dictionary = {}


func _get_importer_name() -> String:
	return "fire_atlas.recipe"


func _get_visible_name() -> String:
	return "Fire"


func _get_recognized_extensions() -> PackedStringArray:
	return PackedStringArray(["fire"])


func _get_save_extension() -> String:
	return "tscn"


func _get_resource_type() -> String:
	return "PackedScene"


func _get_priority() -> float:
	return 1.0


func _get_import_order() -> int:
	return 0


func _get_preset_count() -> int:
	return 1


func _get_preset_name(_preset: int) -> String:
	return "Default"


# A build uses all cores by itself, and the list of files is not for threads.
func _can_import_threaded() -> bool:
	return false


func _get_import_options(_path: String, _preset: int) -> Array[Dictionary]:
	return []


func _get_option_visibility(_path: String, _option: StringName, _options: Dictionary) -> bool:
	return true


func _import(
	recipe: String,
	save_path: String,
	_options: Dictionary,
	_platform_variants: Array[String],
	gen_files: Array[String]
) -> Error:
	var began: int = int(Time.get_unix_time_from_system())
	print("Fire Atlas: building %s" % recipe)
	var builder: Builder = Builder.new()
	builder.build(Program.command_of(settings), recipe, save_path + ".d")
	for note in builder.notes:
		print("Fire Atlas: %s: %s" % [recipe, note])
	if builder.errors.size() > 0:
		return _fail(recipe, save_path, builder, began)
	failed.erase(recipe)
	Inputs.remember(save_path, recipe, builder.inputs, began, false)
	has_built = has_built or builder.is_new
	for output in builder.outputs:
		if not output.ends_with(".import") and not output.ends_with(".uid"):
			gen_files.append(output)
	# Pictures are imported now, so that the scene can be opened at once.
	for picture in builder.pictures:
		filesystem.update_file(picture)
		append_import_external_resource(picture)
	print("Fire Atlas: %s: %s" % [recipe, "built" if builder.is_new else "up to date"])
	var is_written: bool = Files.write_text(save_path + ".tscn", _scene(builder))
	return OK if is_written else ERR_FILE_CANT_WRITE


# Shows what is wrong. An asset that was built before stays as it is.
func _fail(
	recipe: String, save_path: String, builder: Builder, began: int
) -> Error:
	for error in builder.errors:
		push_error("%s: %s" % [recipe, error])
	failed[recipe] = [Files.changed_at(recipe), began]
	var inputs: PackedStringArray = builder.inputs
	if inputs.size() == 0:
		inputs = Inputs.remembered(save_path)
	Inputs.remember(save_path, recipe, inputs, began, true)
	if Files.changed_at(save_path + ".tscn") == 0:
		return ERR_CANT_CREATE
	print("Fire Atlas: %s stays as it was built before" % recipe)
	return OK


# Returns a scene that inherits the one which the build has written.
func _scene(builder: Builder) -> String:
	var names: Array = [builder.scene.c_escape(), builder.root.c_escape()]
	return """[gd_scene format=3]

[ext_resource type="PackedScene" path="%s" id="1"]

[node name="%s" instance=ExtResource("1")]
""" % names
