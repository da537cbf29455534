@tool
extends RefCounted
# Reads and writes small files.
# Written by `fire-atlas plugin godot`, which writes it anew.


static func is_file(path: String) -> bool:
	return FileAccess.file_exists(path)


# Returns the content of a file; "" if it cannot be read.
static func read_text(path: String) -> String:
	return FileAccess.get_file_as_string(path) if is_file(path) else ""


# Returns the object that a JSON text describes; an empty one if it describes none.
static func parsed(text: String) -> Dictionary:
	if not text.begins_with("{"):  # the engine would print an error
		return {}
	var json: JSON = JSON.new()
	if json.parse(text) == OK and json.data is Dictionary:
		return json.data
	return {}


# Returns whether the file could be written.
static func write_text(path: String, text: String) -> bool:
	var file: FileAccess = FileAccess.open(path, FileAccess.WRITE)
	if file == null:
		return false
	file.store_string(text)
	file.close()
	return true


static func remove(path: String) -> void:
	DirAccess.remove_absolute(path)


# Returns when a file or folder was changed, in s of Unix time; 0 if it does not exist.
static func changed_at(path: String) -> int:
	var is_there: bool = is_file(path) or DirAccess.dir_exists_absolute(path)
	return FileAccess.get_modified_time(path) if is_there else 0


# Returns the names of the files in a folder.
static func names_in(folder: String) -> Array:
	return Array(DirAccess.get_files_at(folder)) if DirAccess.dir_exists_absolute(folder) else []


# Returns a path that does not depend on the folder in which the editor was started.
static func whole_path(path: String) -> String:
	if path.is_absolute_path():
		return path
	return DirAccess.open(".").get_current_dir() + "/" + path
