"""Exact flows of piecewise linear systems, several motions to one instruction.

    lowering/piecewise_linear.py      which declarations are linear with constant factors in every mode, and why not
    codegen/lane_tables.py            of those, which have only contacts that lanes follow; rows and sums as a header,
                                      among the sources of the FMU
    c/lane_table.h, lane_grid.*       numbers of one motion, exact steps at home among them
    c/lane_modes.*, lane_held.*       a LaneMode per mode of the contacts, made when a motion comes to it; forces that
                                      hold contacts eliminated
    c/lane_code.h                     steps of all lanes, once per width, the same operations in each lane: at home
                                      (lane_home.h), and in batches of what wants the same, to events and over sub-steps
                                      (lane_batch.h, lane_stops.h, lane_series.h, lane_fall.h, lane_roots.h) or away
                                      from home (lane_stride.h), on lane_vectors.h
    c/lane_variation.h, lane_tangents.*  differences of neighbours over sub-steps and through events, in a batch or by
                                      one lane, set at right angles at the end of a period; at home groups step them
    c/lane_event.*, lane_transition.* what one lane does at an event: by itself where one contact alone decides, else by
                                      asking the engine, from the same point
    c/targets.c                       widths by target, and the choice by CPUID; the library's one function
    library.py                        builds and loads it beside the FMU
    engine/ensemble/lane_stepper.h    the contract; engine/ensemble/lane_runs.c makes runs with it, and those steps by
                                      series that lanes leave

Only strobes are made this way. Single runs stay with the series, and with them inputs that are ramps or linear between
knots, which no strobe repeats: lanes have a state at each strobe, and a run also has its events, its outputs from the
series of each step and a watch on its energy, which cost as much as the steps do from some ten samples a period on
(tests/benchmarks/bench_lanes.py).

What happens at events is told twice: in full for one lane (``lane_event``), and for all lanes of a batch where it is
the plain case of an impact or a switch (``impacts``, ``switches``); stops that no held contact feels have the latter
alone (``stops``). A further contact state is a digit of a mode
(``_digits``, ``state_of``), its guards (``full_guard``) and its transition (``lane_transition``). A step that lanes
cannot make at all is marked ``failed``: the series of the engine make it, and it is counted. Whatever is added must
keep every lane's operations free of the others.
"""
