"""The studio: a page in which the commands are given, on this machine alone.

    study.py     a study: a folder, and `study.toml` with the commands that were given in it
    forms.py     a command's options as fields of a form, and back to its arguments; what may come next
    steps.py     commands as they run: their output, files and end
    questions.py the questions on logs as a form, and its answers as a file
    places.py    places in a picture: the point next to a click, and the form that begins there
    server.py    pages over HTTP; who may ask for them
    web/         templates, style

A page does what a command does: it fills in a command line, runs it, and shows what it says and writes. The page
knows nothing else; whoever has the folder repeats it by `stickslip run study.toml`.

Tornado serves: one package without others, which answers tests, forms, uploads and forged requests by itself. Panel,
NiceGUI, marimo and Streamlit bring a frame of their own for widgets, some 30 to 200 MB of packages and scripts, where
forms of HTML do, which keyboards and readers of screens know.
"""
