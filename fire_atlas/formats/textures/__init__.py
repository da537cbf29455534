"""Compressed textures for GPUs: blocks of pixels, and the files that hold them."""
