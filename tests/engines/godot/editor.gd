extends Node
# Stands in for the classes of the editor, which this runtime lacks.

signal filesystem_changed
signal sources_changed(exist: bool)
signal resources_reimporting(paths: PackedStringArray)
signal resources_reimported(paths: PackedStringArray)

# The one that all others ask; the importer it was given, and what it was told to do.
static var editor: Node
static var importer: Node
static var calls: Array = []

var skipped: int = 0
# The settings of the user's editor.
var users_settings: Dictionary = {}


# Runs a program: what it says of a recipe, the last of the arguments, is in a file in its place.
static func execute(program: String, arguments: PackedStringArray, said: Array) -> void:
	var users: String = ProjectSettings.globalize_path("user://")
	var named: Array = Array(arguments).map(
		func(each: String) -> String: return each.replace(users, "user://")
	)
	calls.append(["run", program] + named)
	var file: String = "user:/%s/%s" % [program, arguments[-1].get_file()]
	said.append(FileAccess.get_file_as_string(file) if FileAccess.file_exists(file) else "")


func get_editor_interface() -> Node:
	return editor


func get_resource_filesystem() -> Node:
	return editor


func get_editor_settings() -> Node:
	return editor


func has_setting(setting: String) -> bool:
	return users_settings.has(setting)


func set_setting(setting: String, value: Variant) -> void:
	users_settings[setting] = value


func set_initial_value(setting: StringName, _value: Variant, _update_current: bool) -> void:
	assert(has_setting(setting))


func add_property_info(info: Dictionary) -> void:
	calls.append(["setting", info["name"]])


# As in Godot 4.5 and later, a project overrides what this returns, but not what `get` does.
func get_setting(setting: String) -> Variant:
	return ProjectSettings.get_setting("editor_overrides/" + setting, users_settings[setting])


func _get(setting: StringName) -> Variant:
	return users_settings.get(String(setting))


func add_import_plugin(plugin: Node) -> void:
	importer = plugin


func remove_import_plugin(_plugin: Node) -> void:
	importer.free()


func add_export_plugin(_plugin: Node) -> void:
	pass


func remove_export_plugin(plugin: Node) -> void:
	plugin.free()


func append_import_external_resource(path: String) -> Error:
	calls.append(["import", path])
	return OK


func update_file(path: String) -> void:
	calls.append(["update", path])


func reimport_files(paths: PackedStringArray) -> void:
	calls.append(["reimport", ",".join(paths)])


func is_scanning() -> bool:
	return false


func scan() -> void:
	calls.append(["scan", ""])


func skip() -> void:
	skipped += 1
