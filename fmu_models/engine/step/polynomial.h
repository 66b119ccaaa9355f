/*
 * A polynomial c[0] + c[1] s + ... + c[n] s^n and its slope, per type of number: the one that Number and POLYNOMIAL name
 * where this is included.
 */
Number POLYNOMIAL(value)(const Number *c, int n, double s)
{
    /* every third power apart: chains of a third of the length; the first term last, by one rounding of its size */
    const double t = s * s * s;
    const Number none = (Number){0.0};
    Number first = none, second = none, third = none;
    int k = n;
    for (; k % 3 != 0; k--)
        *(k % 3 == 1 ? &first : &second) = c[k];
    for (; k >= 3; k -= 3) {
        third = third * t + c[k];
        second = second * t + c[k - 1];
        first = first * t + c[k - 2];
    }
    return c[0] + s * (first + s * (second + s * third));
}

Number POLYNOMIAL(slope)(const Number *c, int n, double s)
{
    Number rate[POLYNOMIAL_TERMS];
    rate[0] = (Number){0.0};
    for (int k = 1; k <= n; k++)
        rate[k - 1] = k * c[k];
    return POLYNOMIAL(value)(rate, n > 0 ? n - 1 : 0, s);
}

#undef Number
#undef POLYNOMIAL
