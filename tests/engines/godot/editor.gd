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


func get_editor_interface() -> Node:
	return editor


func get_resource_filesystem() -> Node:
	return editor


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
