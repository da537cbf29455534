@tool
extends EditorPlugin
# Imports recipes of fire-atlas (*.fire), again when what they are built from changes, and keeps out
# of exported games what only the editor needs.
# Written by `fire-atlas plugin godot`, which writes it anew.

const Exporter = preload("exporter.gd")
const Files = preload("files.gd")
const Importer = preload("importer.gd")
const Inputs = preload("inputs.gd")
const Program = preload("program.gd")

const IGNORED: String = (
	"Fire Atlas: the project's setting %s is ignored, since a project may come from anyone. Set"
	+ " the program in %s, and remove the line from project.godot"
)

var _exporter: Exporter
var _importer: Importer
var _filesystem: EditorFileSystem
# Whether the recipes were tried again that could not be built when the editor was open before.
var _has_retried: bool = false
# Imports that are running; while one does, the editor may draw, and so call this add-on.
var _running: int = 0


func _enter_tree() -> void:
	var settings: EditorSettings = get_editor_interface().get_editor_settings()
	_add_command(settings)
	_add_setting(Exporter.SETTING, false)
	_filesystem = get_editor_interface().get_resource_filesystem()
	_importer = Importer.new()
	_importer.filesystem = _filesystem
	_importer.settings = settings
	_exporter = Exporter.new()
	add_import_plugin(_importer)
	add_export_plugin(_exporter)
	for changed in ["filesystem_changed", "sources_changed"]:
		_filesystem.connect(changed, _look, CONNECT_DEFERRED)
	if _filesystem.has_signal("resources_reimporting"):
		_filesystem.connect("resources_reimporting", _begin_import)
		_filesystem.connect("resources_reimported", _end_import)


func _exit_tree() -> void:
	for changed in ["filesystem_changed", "sources_changed"]:
		_filesystem.disconnect(changed, _look)
	if _filesystem.has_signal("resources_reimporting"):
		_filesystem.disconnect("resources_reimporting", _begin_import)
		_filesystem.disconnect("resources_reimported", _end_import)
	remove_export_plugin(_exporter)
	remove_import_plugin(_importer)


# Looks for changes when the user comes back from another program.
func _notification(what: int) -> void:
	if what == NOTIFICATION_APPLICATION_FOCUS_IN:
		call_deferred("_look")


func _begin_import(_paths: PackedStringArray) -> void:
	_running += 1


func _end_import(_paths: PackedStringArray) -> void:
	_running = maxi(_running - 1, 0)
	if _running == 0:
		call_deferred("_look")


# Lets the editor look at what builds have written, and import those recipes anew whose inputs have
# changed. While the editor is busy nothing is done: this is called again when it is ready.
func _look(_has_sources: bool = false) -> void:
	if _filesystem == null or _filesystem.is_scanning() or _running > 0:
		return
	if _importer.has_built:
		_importer.has_built = false
		_filesystem.scan()
		return
	var recipes: Dictionary = Inputs.find_changed(Inputs.imported(), not _has_retried)
	if not _has_retried:
		_has_retried = true
		for recipe in _importer.failed:
			recipes.erase(recipe)
	if recipes.size() > 0:
		_filesystem.reimport_files(PackedStringArray(recipes.keys()))


# Adds the command to the settings of the user's editor. What a project says of it has no effect.
func _add_command(settings: EditorSettings) -> void:
	if not settings.has_setting(Program.SETTING):
		settings.set_setting(Program.SETTING, Program.COMMAND)
	settings.set_initial_value(Program.SETTING, Program.COMMAND, false)
	settings.add_property_info({"name": Program.SETTING, "type": TYPE_STRING})
	for setting in [Program.SETTING, Program.OVERRIDE]:
		if ProjectSettings.has_setting(setting):
			push_warning(IGNORED % [setting, Program.WHERE])


# Adds a setting to the project, which is saved only where it is not the default.
func _add_setting(setting: String, default: Variant) -> void:
	if not ProjectSettings.has_setting(setting):
		ProjectSettings.set_setting(setting, default)
	ProjectSettings.set_initial_value(setting, default)
	ProjectSettings.add_property_info({"name": setting, "type": typeof(default)})
