tool
extends EditorPlugin

# What the editor does with `--quit` is too early: it leaves files it has not looked at yet.
# Before it quits, it does what `later.json` lists: moves files, as somebody in another program, from
# which the user then comes back to the editor.

const CALM_FRAMES = 8
const LATER = "res://later.json"

var calm = 0
# The dialog that is seen as long as an import is under way. It draws itself in frames within a frame,
# in which nothing else tells of the import.
var progress


func _enter_tree():
	var editor = get_editor_interface()
	var files = editor.get_resource_filesystem()
	files.connect("filesystem_changed", self, "_begin_anew")
	files.connect("sources_changed", self, "_begin_anew")
	editor.get_editor_settings().set_setting("interface/editor/quit_confirmation", false)
	for each in editor.get_base_control().get_children():
		if each.get_class() == "ProgressDialog":
			progress = each


func _begin_anew(_exist = false):
	calm = 0


func _process(_delta):
	var busy = get_editor_interface().get_resource_filesystem().is_scanning() or progress.visible
	calm = 0 if busy else calm + 1
	if calm < CALM_FRAMES:
		return
	calm = 0
	if not _do_what_is_left():
		# As one closes its window: after `quit()` alone, the nodes are freed while a thread still draws
		# previews of what was imported, and the editor crashes, or finds its nodes busy.
		get_tree().notification(MainLoop.NOTIFICATION_WM_QUIT_REQUEST)


func _do_what_is_left():
	var file = File.new()
	if file.open(LATER, File.READ) != OK:
		return false
	var moves = parse_json(file.get_as_text())
	file.close()
	Directory.new().remove(LATER)
	OS.delay_msec(1100)  # this engine counts the times of files in whole seconds
	for from in moves:
		Directory.new().rename(from, moves[from])
	get_tree().root.propagate_notification(MainLoop.NOTIFICATION_WM_FOCUS_IN)
	return true
