tool
extends EditorPlugin

# What the editor does with `--quit` is too early: it leaves files it has not looked at yet.
# Before it quits, it does what `later.json` lists: moves files, as somebody in another program, from
# which the user then comes back to the editor.

const CALM_FRAMES = 8
# While the editor imports, it draws its progress in frames within a frame, one in 200 ms at most, of
# which nothing else tells: to quit in one of them ends the import, with errors or a crash.
const WITHIN_AN_IMPORT = 150  # ms between frames
const LATER = "res://later.json"

var calm = 0
var last = 0


func _enter_tree():
	var files = get_editor_interface().get_resource_filesystem()
	files.connect("filesystem_changed", self, "_begin_anew")
	files.connect("sources_changed", self, "_begin_anew")


func _begin_anew(_exist = false):
	calm = 0


func _process(_delta):
	var files = get_editor_interface().get_resource_filesystem()
	var now = OS.get_ticks_msec()
	var busy = files.is_scanning() or now - last > WITHIN_AN_IMPORT
	last = now
	calm = 0 if busy else calm + 1
	if calm < CALM_FRAMES:
		return
	calm = 0
	if not _do_what_is_left():
		get_tree().quit()


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
