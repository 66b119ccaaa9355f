/*
 * Logarithm and power to base 2 for the length of a step, of additions and multiplications alone: the same on every
 * platform. The bits of a number, read as a whole number, are its logarithm with straight lines between the powers of
 * two; with a parabola upon them it is 0.01 off, which is nothing of a length.
 */
#pragma once

#include <math.h>
#include <stdint.h>
#include <string.h>

static inline double rough_log2(double x)
{
    int64_t bits;
    x = fabs(x);
    memcpy(&bits, &x, sizeof bits);
    const double line = (double)bits * 0x1p-52;
    const double f = line - (double)(int)line; /* of a positive number: beyond its floor */
    return line - 1023.0 + 0.344 * f * (1.0 - f);
}

static inline double rough_exp2(double x)
{
    if (!(x > -1022.0 && x < 1023.0)) return x < 0.0 ? 0.0 : INFINITY;
    const int64_t whole = (int64_t)(x + 1023.0); /* of a positive number: its floor */
    const double f = x + 1023.0 - (double)whole;
    const int64_t bits = whole << 52;
    double power;
    memcpy(&power, &bits, sizeof power);
    return power * (1.0 + f * (0.69589012 + f * (0.22486495 + f * 0.07924493)));
}
