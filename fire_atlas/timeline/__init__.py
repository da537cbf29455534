"""Cut, loop and retime a clip: decide which frames follow each other, before their analysis."""
