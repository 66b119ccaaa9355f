"""A model in a page: the engine as WebAssembly, driven by sliders, in one file that needs no server and no network.

    subject.py      what a name, file or scene means: an FMU of ours, and the values that it starts from
    module.py       the engine and the model of that FMU as WebAssembly, and why it cannot be (an FMU of others)
    c/explore.*     the calls and buffers through which a page talks to it
    c/mathematics.* elementary functions with the same bits on every machine
    c/freestanding.c the dozen functions of a C library that the engine asks for, where there is none
    description.py  what the page knows of the model: quantities, ranges, contacts, the command line
    web/*.mjs       engine (one motion), reading (what it is), sweep (many, in workers), plot (canvas, SVG), elements,
                    pictures (of a motion), diagram (over a parameter), page (controls and state)
    page.py         the page of a model
    bundle.py       all of these in one file, with the hashes of its scripts in its policy; the same page in a frame

What happens when a slider moves:

    state            values of parameters, inputs and starts; length of the run; what is drawn
      -> run         engine.start(values); engine.go(times, section) within a budget of time; refused: in its words
      -> reading     section points -> period n; events of the last n points -> word, shares of stick; extremes
      -> pictures    portrait, time series with contacts shaded, section
      -> permalink   the state after #, as JSON

    sweep            values of a parameter, dealt out to workers in runs of neighbours
      worker         per value: engine.start(from where the last value ended), transient, section points -> main
      -> picture     points over the parameter, drawn as they come; a click sets the parameter

A section is the strobe of the forcing where the equations have one frequency (explore_period), otherwise a level that a
state crosses again and again, found from the motion itself.
"""
