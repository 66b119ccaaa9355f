#include "tolerances.h"

const MasterTolerances master_tolerances = {
    .event_iterations = 100,
    .stalled_events = 1000,
    .trial_errors = 20,
    .chatter_events = 6,
    .chatter_gap = 1e-12,
    .rate_events = 256,
    .rate_gap = 1e-8,
    .quick_slides = 50,
    .pace_steps = 100000,
    .pace = 1e-4,
    .noise_steps = 1000,
    .noise_pace = 1e-5,
    .noise = 0.5,
    .zeno_ratios = 8,
    .zeno_spread = 0.02,
    .zeno_rest = 1e-9,
    .zeno_still = 1e-4,
    .graze = 1e-9,
    .trust = 1e-4,
    .halvings = 6,
};
