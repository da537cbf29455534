# Answers which program the add-on finds, for each command, PATH, project and whether the system is
# Windows, of the job.
extends "res://job.gd"


func run(job):
	var program = load("res://addons/fire_atlas/program.gd")
	var found = []
	for asked in job:
		found.append(program.callv("find", asked))
	answer(found)
