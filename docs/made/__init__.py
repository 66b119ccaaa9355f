"""Pages that are made from the code when the manual is built, so that nothing is typed twice.

Each module has a function ``pages`` that gives their text by file name below the manual. They are written into the
manual's folder, where git does not look (see `.gitignore`), and only where they have changed.

`gallery` is an extension of Sphinx by itself: it computes its pages and pictures, in processes of their own.
"""
