extends Node
# Stands in for the classes of the editor, which this runtime lacks.

var skipped: int = 0
var calls: Array = []


func skip() -> void:
	skipped += 1


func append_import_external_resource(path: String) -> Error:
	calls.append(path)
	return OK


func get_editor_interface() -> Node:
	return self


func get_resource_filesystem() -> Node:
	return self


func add_import_plugin(_plugin: Object) -> void:
	pass


func add_export_plugin(_plugin: Object) -> void:
	pass


func remove_import_plugin(_plugin: Object) -> void:
	pass


func remove_export_plugin(_plugin: Object) -> void:
	pass
