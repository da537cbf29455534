@tool
extends EditorExportPlugin
# Keeps out of exported games what their scenes do not read: manifests, the files of a build that
# describe it to other programs, and the scripts of this add-on that only the editor runs.
# Written by `fire-atlas plugin godot`, which writes it anew.

const Files = preload("files.gd")

# The project setting that lets atlases, tracks and light in JSON and the like into the game, for
# scripts of the game that read them.
const SETTING: String = "fire_atlas/export_json"

const MANIFEST: String = ".manifest.json"
# What a manifest of fire-atlas states; files of others may end alike.
const FORMAT: String = "fire-atlas/manifest"
# Roles, as in manifests, of files that scenes do not read.
const DESCRIPTIONS: Array = ["atlas", "tracks", "light"]
const OF_THE_EDITOR: Array = [
	"builder.gd", "exporter.gd", "files.gd", "importer.gd", "inputs.gd", "plugin.gd", "program.gd"
]

# Files that stay out of the game, by folder; of the folders that were looked at.
var _kept_out: Dictionary = {}


func _get_name() -> String:
	return "fire_atlas"


func _export_begin(
	_features: PackedStringArray, _is_debug: bool, _path: String, _flags: int
) -> void:
	_kept_out.clear()


func _export_file(
	path: String, _type: String, _features: PackedStringArray
) -> void:
	var folder: String = path.get_base_dir()
	if not _kept_out.has(folder):
		_kept_out[folder] = _names_kept_out(folder)
	if path.get_file() in _kept_out[folder]:
		skip()


# Returns the names of the files in a folder that stay out of the game.
func _names_kept_out(folder: String) -> Array:
	var names: Array = []
	if folder == get_script().resource_path.get_base_dir():
		names += OF_THE_EDITOR
	for name in Files.names_in(folder):
		if not name.ends_with(MANIFEST):
			continue
		var manifest: Dictionary = Files.parsed(Files.read_text(folder + "/" + name))
		if manifest.get("format") != FORMAT:
			continue
		names.append(name)
		if not ProjectSettings.get_setting(SETTING):
			for output in manifest["outputs"]:
				if output["role"] in DESCRIPTIONS:
					names.append(output["path"])
	return names
