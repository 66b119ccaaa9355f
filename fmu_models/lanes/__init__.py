"""Exact flows of piecewise linear systems, several motions to one instruction.

    lowering/piecewise_linear.py      which declarations are linear with constant factors in every mode, and why not
    codegen/lane_tables.py            of those, which have only contacts that lanes follow; rows and sums as a header,
                                      among the sources of the FMU
    c/lane_table.*                    numbers of one motion: a LaneMode per mode of the contacts, exact steps at home
    c/lane_code.h                     steps of all lanes, once per width; the same operations in each lane, on
                                      lane_vectors.h and lane_roots.h
    c/lane_variation.h, lane_tangents.*  differences of neighbours, over sub-steps, at home and through events
    c/lane_event.*                    what one lane does at an event, and what it leaves to the series
    c/targets.c                       widths by target, and the choice by CPUID; the library's one function
    library.py                        builds and loads it beside the FMU
    engine/ensemble/lane_stepper.h    the contract; engine/ensemble/lane_runs.c makes runs with it, and those steps by
                                      series that lanes leave

A further contact state is a digit of a mode (``_digits``, ``state_of``), its guards (``full_guard``) and its transition
(``lane_event``); a mode in which forces hold a contact needs its flow with these forces eliminated (``full_flow``), and
what lanes cannot decide is marked ``failed``. Whatever is added must keep every lane's operations free of the others.
"""
