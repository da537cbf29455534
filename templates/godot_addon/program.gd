@tool
extends RefCounted
# Finds the program that builds recipes. A project may come from anyone, and may hold a program of
# that name: such a one runs only if the user has named its path.
# Written by `fire-atlas plugin godot`, which writes it anew.

const Files = preload("files.gd")

# The setting that holds the command: its name, if it is on the PATH, or its path. It is one of the
# user's editor; the same one of a project names nothing.
const SETTING: String = "fire_atlas/command"
const COMMAND: String = "fire-atlas"
# Where a project can override a setting of the editor, in newer versions of the engine.
const OVERRIDE: String = "editor_overrides/" + SETTING
const WHERE: String = "Editor > Editor Settings > Fire Atlas > Command (with Advanced Settings on)"


# Returns the command that the user's settings hold, whatever the project's say (`get_setting` would
# return what a project overrides), without the quotes that Windows' Explorer copies with a path.
static func command_of(settings: EditorSettings) -> String:
	return str(settings.get(SETTING)).strip_edges().trim_prefix("\"").trim_suffix("\"")


# Returns the whole path of a program. A name is looked for in the folders of `path`, the system's
# PATH, but in none that is relative or lies in a project, as npm's node_modules/.bin does; "" if it
# is in no other. A path is taken as it is, and begins in the folder `project` if it is relative.
static func find(command: String, path: String, project: String, on_windows: bool) -> String:
	var name: String = _with_slashes(command, on_windows)
	if "/" in name:
		return command if _is_absolute(name, on_windows) else project + "/" + command
	if on_windows and not name.to_lower().ends_with(".exe"):
		name += ".exe"
	for folder in path.split(";" if on_windows else ":", false):
		var plain: String = _with_slashes(folder, on_windows)
		var program: String = plain + "/" + name
		if _is_absolute(plain, on_windows) and Files.is_file(program) and not _is_in_project(plain):
			return program.replace("/", "\\") if on_windows else program
	return ""


static func _with_slashes(path: String, on_windows: bool) -> String:
	return path.replace("\"", "").replace("\\", "/") if on_windows else path


static func _is_absolute(path: String, on_windows: bool) -> bool:
	if on_windows:
		return path.begins_with("//") or path.substr(1, 2) == ":/"
	return path.begins_with("/")


# Returns whether a folder, or one above it, is that of a project. The system is asked, not the
# names: a folder has several of them, by links and by capitals.
static func _is_in_project(folder: String) -> bool:
	var above: String = ""
	for name in folder.split("/"):
		above += name + "/"
		if Files.is_file(above + "project.godot"):
			return true
	return false
