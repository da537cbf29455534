@tool
extends RefCounted
# Builds a recipe by the command `fire-atlas`, and reads what the command says and writes.
# Written by `fire-atlas plugin godot`, which writes it anew.

const Files = preload("files.gd")
const Program = preload("program.gd")

const INSTALL: String = (
	"`%s` cannot be run. Install it (`pip install ./fire-atlas` in the folder that holds its"
	+ " checkout). If it is installed, or lies in the project, set the path of the program in "
	+ Program.WHERE
	+ ". Then reimport the recipe."
)
const NO_SCENE: String = (
	"its build writes no scene for Godot 4: write"
	+ " `exports: [godot]` into the recipe"
)
const NAME_OF_ROOT: String = "[node name=\""

# What is wrong, each with advice. Empty if the recipe was built.
var errors: PackedStringArray = PackedStringArray()
# What the command notes about the fire.
var notes: PackedStringArray = PackedStringArray()
# Whether the recipe was built now, and not up to date.
var is_new: bool = false
# The scene that the build has written, and the name of its root.
var scene: String = ""
var root: String = ""
# All files of the build, and those of them that the editor imports.
var outputs: PackedStringArray = PackedStringArray()
var pictures: PackedStringArray = PackedStringArray()
# Files and folders that the build depends on, beside the recipe; paths of the system.
var inputs: PackedStringArray = PackedStringArray()


# Builds the recipe by a command: a name or a path. `depfile` is where the command lists what the
# build depends on. It and the recipe are paths in the project, like res://campfire.fire.
func build(command: String, recipe: String, depfile: String) -> void:
	var program: String = Program.find(
		command,
		OS.get_environment("PATH"),
		ProjectSettings.globalize_path("res://").trim_suffix("/"),
		OS.get_name() == "Windows"
	)
	if program == "":
		errors.append(INSTALL % command)
		return
	var path: String = ProjectSettings.globalize_path(recipe)
	var list: String = ProjectSettings.globalize_path(depfile)
	var arguments: PackedStringArray = PackedStringArray(["build", "--json", "--depfile", list, path])
	var said: Array = []
	OS.execute(program, arguments, said, true)
	read_events("".join(PackedStringArray(said)), command)
	if errors.size() == 0:
		_read_outputs(depfile, path)


# Reads the JSON lines that the command prints. If there are none, it was not fire-atlas that ran.
func read_events(said: String, command: String) -> void:
	var others: PackedStringArray = PackedStringArray()
	var count: int = 0
	for line in said.split("\n", false):
		var event: Dictionary = Files.parsed(line)
		if not event.has("event"):
			others.append(line)
			continue
		count += 1
		match event["event"]:
			"error":
				errors.append(event["message"])
			"note":
				notes.append(event["message"])
			"done":
				is_new = not event["fresh"]
	if count == 0:
		errors.append(INSTALL % command)
		errors.append_array(others)


# Reads from the depfile what the build depends on and where its manifest is, and from the manifest
# which files it has written.
func _read_outputs(depfile: String, recipe: String) -> void:
	var paths: PackedStringArray = read_depfile(Files.read_text(depfile))
	var manifest: String = ProjectSettings.localize_path(paths[0])
	for i in range(1, paths.size()):
		if paths[i] != recipe:
			inputs.append(paths[i])
	var listed: Dictionary = Files.parsed(Files.read_text(manifest))
	if not listed.has("outputs"):
		errors.append("%s cannot be read: remove it, then reimport the recipe" % manifest)
		return
	var folder: String = manifest.get_base_dir() + "/"
	for output in listed["outputs"]:
		var file: String = folder + output["path"]
		outputs.append(file)
		if output["role"] == "page" or output["role"] == "map":
			pictures.append(file)
	scene = folder + listed["name"] + ".tscn"
	root = read_root(Files.read_text(scene)) if scene in outputs else ""
	if root == "":
		errors.append(NO_SCENE)


# Returns the name of the root of a scene; "" if the text is no scene of this version of the engine.
static func read_root(text: String) -> String:
	var tag: String = text.substr(0, text.find("]")) + " "
	var start: int = text.find(NAME_OF_ROOT)
	if not " format=3 " in tag or start < 0:
		return ""
	start += NAME_OF_ROOT.length()
	return text.substr(start, text.find("\"", start) - start)


# Returns the target of the first rule in a depfile, and all that it depends on, as whole paths.
static func read_depfile(text: String) -> PackedStringArray:
	var paths: PackedStringArray = PackedStringArray()
	var rule: String = text.split("\n\n")[0].trim_suffix("\n")
	for line in rule.split(" \\\n"):
		var path: String = line.strip_edges().trim_suffix(":")
		for escaped in " #:":
			path = path.replace("\\" + escaped, escaped)
		paths.append(Files.whole_path(path.replace("$$", "$")))
	return paths
