tool
extends EditorPlugin

# What the editor does with `--quit` is too early: it leaves files it has not looked at yet.

const CALM_FRAMES = 4

var calm = 0


func _process(_delta):
	var files = get_editor_interface().get_resource_filesystem()
	calm = 0 if files.is_scanning() else calm + 1
	if calm == CALM_FRAMES:
		get_tree().quit()
