"""Random sequences of what artists do, in a window of Blender: strokes, undo, redo, changes of layers, save, reload.

After every action the file is compared with what it has to be (undo: the state before, bit by bit), and at the end with
a fresh file that was brought straight to the same layers and maps.
"""
