"""What all packages use: pixels, clips, errors, random numbers, files, workers."""
