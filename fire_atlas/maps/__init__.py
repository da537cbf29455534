"""Maps: further images beside the pages of an atlas, each with the layout of its page.

``kinds.py`` lists them; each kind is made by one module here.
"""
