/* First fall of a polynomial to zero on an interval. */
#pragma once

enum { POLYNOMIAL_TERMS = 33 };

/* c[0] + c[1] s + ... + c[n] s^n, and its slope */
double polynomial_value(const double *c, int n, double s);
double polynomial_slope(const double *c, int n, double s);

/* smallest s in (0, h] at which the polynomial, positive before, falls to zero; 0 if it starts at or below zero; -1 if
   none */
double first_fall(const double *c, int n, double h);
/* the same of the polynomial times a sign, 1 or -1 */
double signed_first_fall(const double *c, int n, double sign, double h);
/* the same, where what falls after `until` may be left out */
double fall_until(const double *c, int n, double sign, double h, double until);

/* a length, at most h, up to which sign times the polynomial certainly stays above slack > 0, and near the largest; 0 if
   it does not start there */
double safe_length(const double *c, int n, double sign, double h, double slack);
