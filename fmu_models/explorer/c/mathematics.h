/*
 * Elementary functions that give the same bits on every machine: what follows this header calls these and not those of
 * a C library, of which each rounds in its own way. Sums, products, quotients, roots and rint are exact to the last digit
 * everywhere and stay.
 */
#pragma once

#include <math.h>

double same_exp(double x);
double same_log(double x);
double same_log2(double x);
double same_pow(double x, double y);
/* nan beyond 2^52, where a digit is more than half a radian */
double same_sin(double x);
double same_cos(double x);
double same_tan(double x);
double same_sinh(double x);
double same_cosh(double x);
double same_tanh(double x);
double same_atan(double x);

/* exact but for results below 2.2e-308, which are rounded twice */
double same_fma(double a, double b, double c);

/* of zeros of both signs the first; the other where one is nan */
static inline double same_fmin(double a, double b) { return b < a || a != a ? b : a; }
static inline double same_fmax(double a, double b) { return b > a || a != a ? b : a; }

#define exp same_exp
#define log same_log
#define log2 same_log2
#define pow same_pow
#define sin same_sin
#define cos same_cos
#define tan same_tan
#define sinh same_sinh
#define cosh same_cosh
#define tanh same_tanh
#define atan same_atan
#define fma same_fma
#define fmin same_fmin
#define fmax same_fmax
