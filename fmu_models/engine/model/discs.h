/*
 * Radii of images: an operation on series takes discs about their values to a disc about its own. With operands a, b
 * anywhere within r, s of their centres, the image of f differs from its centre by no more than the radius here; several
 * discs are followed at once.
 *
 *     sum of c a      sum of |c| r
 *     a b             |a| s + |b| r + r s
 *     a/b             (r + |q| s)/(|b| - s), where s < |b|
 *     exp             e^a (e^r - 1)
 *     sin, cos, ...   |y| (cosh r - 1) + |y of the partner| sinh r
 *     tanh            beyond |a| - r > 0 what is left of both sides; or by tan r
 *     sqrt, log, a^e  their series with all terms positive, where r < |a|; atan along rays
 *
 * A function with no bound has the largest radius. No operation overflows, divides by zero or makes NaN of numbers.
 */
#pragma once

#include "model.h"
#include "rough.h"

/* discs of time that are followed together: orders 0, 1, ... of a series keep their radii */
enum { DISCS = 4 };

/* as good as none; its square is a number */
static const double DISC_LARGEST = 1e150;

/* the part of the distance to a pole beyond which a radius has no bound */
static const double DISC_NEAR = 0.999;

static inline double disc_bounded(double radius) { return radius < DISC_LARGEST ? radius : DISC_LARGEST; }

/* e^x, and e^x - 1 of a positive number, from above */
static inline double disc_power_of_e(double x) { return disc_bounded(1.0002 * rough_exp2(1.4426950408889634 * x)); }

static inline double disc_growth(double x)
{
    return x < 0.5 ? x * (1.0 + x * (0.5 + 0.2 * x)) : disc_power_of_e(x) - 1.0;
}

/* -log(1 - t) from above, 0 <= t < 1 */
static inline double disc_log_ratio(double t)
{
    return t < 0.5 ? t * (1.0 + t * (0.5 + t / (3.0 * (1.0 - t)))) : 0.01 - 0.69314718 * rough_log2(1.0 - t);
}

static CALLED void disc_zero(double *r)
{
    for (int m = 0; m < DISCS; m++)
        r[m] = 0.0;
}

/* r = c s */
static CALLED void disc_multiple(double *r, double c, const double *s)
{
    for (int m = 0; m < DISCS; m++)
        r[m] = disc_bounded(c * s[m]);
}

/* r += c s */
static CALLED void disc_add(double *r, double c, const double *s)
{
    for (int m = 0; m < DISCS; m++)
        r[m] = disc_bounded(r[m] + c * s[m]);
}

static CALLED void disc_product(double *y, double a, const double *r, double b, const double *s)
{
    for (int m = 0; m < DISCS; m++)
        y[m] = disc_bounded(fabs(a) * s[m] + fabs(b) * r[m] + r[m] * s[m]);
}

/* q = a/b where the disc of b is c s; r: of a, or NULL where a is constant */
static CALLED void disc_quotient(double *y, const double *r, double b, double c, const double *s, double q)
{
    for (int m = 0; m < DISCS; m++) {
        const double near = fabs(c) * s[m];
        const int bounded = near < DISC_NEAR * fabs(b) && fabs(b) > 1.0 / DISC_LARGEST;
        y[m] = bounded ? disc_bounded(((r ? r[m] : 0.0) + fabs(q) * near) / (fabs(b) - near)) : DISC_LARGEST;
    }
}

static CALLED void disc_exp(double *y, double a, const double *r, double value)
{
    for (int m = 0; m < DISCS; m++)
        y[m] = r[m] < 1.0 ? disc_bounded(fabs(value) * disc_growth(r[m])) : disc_power_of_e(a + r[m]);
}

/* sine and cosine, circular or hyperbolic, of which this is one and `partner` the other */
static CALLED void disc_wave(double *y, const double *r, double value, double partner)
{
    for (int m = 0; m < DISCS; m++) {
        const double e = disc_growth(r[m]);
        const double sine = 0.5 * e * ((e + 2.0) / (e + 1.0));
        y[m] = disc_bounded(fabs(value) * (sine - e / (1.0 + e)) + fabs(partner) * sine);
    }
}

static CALLED void disc_tanh(double *y, double a, const double *r, double value)
{
    const double left = disc_power_of_e(-2.0 * fabs(a)); /* 1 - |tanh| is twice this at most */
    const double slope = 4.0 * left / ((1.0 + left) * (1.0 + left));
    for (int m = 0; m < DISCS; m++) {
        const double beyond = fabs(a) - r[m];
        double radius = beyond > 1e-3 ? 2.0 / disc_growth(2.0 * beyond) + 2.0 * left : DISC_LARGEST;
        if (r[m] < 1.5) {
            const double tangent = r[m] * 9.8696044 / (9.8696044 - 4.0 * r[m] * r[m]); /* from above */
            const double by_tangent =
                fabs(value) * tangent < DISC_NEAR ? tangent * slope / (1.0 - fabs(value) * tangent) : DISC_LARGEST;
            radius = by_tangent < radius ? by_tangent : radius;
        }
        y[m] = radius;
    }
}

static CALLED void disc_sqrt(double *y, double a, const double *r, double part)
{
    for (int m = 0; m < DISCS; m++)
        y[m] = r[m] < part * a ? r[m] / (sqrt(a) + sqrt(a - r[m])) : DISC_LARGEST;
}

/* the root of a depth has its own place where it begins, which its series shows: bounded across it */
static CALLED void disc_root(double *y, double a, const double *r)
{
    disc_sqrt(y, a, r, 0.9);
    for (int m = 0; m < DISCS; m++)
        y[m] = y[m] < DISC_LARGEST ? y[m] : sqrt(fabs(a) + r[m]);
}

static CALLED void disc_log(double *y, double a, const double *r)
{
    for (int m = 0; m < DISCS; m++)
        y[m] = r[m] < DISC_NEAR * a ? disc_log_ratio(r[m] / a) : DISC_LARGEST;
}

static CALLED void disc_power(double *y, double a, const double *r, double exponent, double value)
{
    disc_log(y, a, r);
    for (int m = 0; m < DISCS; m++)
        y[m] = y[m] < DISC_LARGEST ? disc_bounded(fabs(value) * disc_growth(fabs(exponent) * y[m])) : DISC_LARGEST;
}

/* a power above 1 of what may pass zero, bounded across it as a root is */
static CALLED void disc_lifted(double *y, double a, const double *r, double exponent)
{
    disc_power(y, a, r, exponent, pow(fabs(a), exponent));
    for (int m = 0; m < DISCS; m++)
        y[m] = y[m] < DISC_LARGEST ? y[m] : disc_bounded(pow(fabs(a) + r[m], exponent));
}

static CALLED void disc_atan(double *y, double a, const double *r)
{
    const double distance = sqrt(1.0 + a * a); /* to its poles */
    for (int m = 0; m < DISCS; m++)
        y[m] = r[m] < DISC_NEAR * distance ? r[m] / (distance * (distance - r[m])) : DISC_LARGEST;
}

/*
 * The discs of the solution x of (A + dA) x = b are below base + B x, with base = |A^-1| (|db| + |dA| |b|) and
 * B = |A^-1| |dA|. With B y <= q y for some y >= base and q < 1, they are below y/(1 - q). Where y = base has next to
 * nothing in a place that B reaches, as where an entry of A^-1 passes zero, more of B y does.
 */
#define DISC_TRIALS 4

/* the largest ratio q of change = B y to y, 1 if it is no less; y with more of that, if `more` */
static inline double disc_ratio(double *y, const double *change, int n, int more)
{
    double ratio = 0.0;
    for (int i = 0; i < n; i++)
        if (change[i] > DISC_NEAR * y[i])
            ratio = 1.0;
        else if (change[i] > 0.0)
            ratio = fmax(ratio, change[i] / y[i]);
    for (int i = 0; more && ratio > 0.75 && i < n; i++)
        y[i] = disc_bounded(y[i] + 4.0 * change[i]);
    return ratio;
}

static inline void disc_solution(const double *y, double ratio, int n, double *x, int stride)
{
    for (int i = 0; i < n; i++)
        x[i * stride] = ratio < 1.0 ? disc_bounded(y[i] / (1.0 - ratio)) : DISC_LARGEST;
}

#define MASS_PLACE(i, c) (model_mass_row[i] + (c))

/* room for M^-1 where inertia moves */
#define DISC_MOVED MODEL_ROOM(MODEL_CONSTANT_INERTIA ? 0 : MODEL_NV)

/* M^-1, by columns, from the factors of mass_matrix.h; where inertia does not move, no disc asks for it */
static inline void disc_mass_inverse(const double *factor, double inverse[DISC_MOVED][DISC_MOVED])
{
    for (int e = 0; !MODEL_CONSTANT_INERTIA && e < MODEL_NV; e++) {
        double *x = inverse[e];
        for (int i = 0; i < MODEL_NV; i++) {
            x[i] = i == e;
            for (int c = model_mass_first[i]; c < i; c++)
                x[i] -= factor[MASS_PLACE(i, c)] * x[c];
        }
        for (int i = 0; i < MODEL_NV; i++)
            x[i] *= factor[MASS_PLACE(i, i)];
        for (int i = MODEL_NV - 1; i >= 0; i--)
            for (int c = model_mass_first[i]; c < i; c++)
                x[c] -= factor[MASS_PLACE(i, c)] * x[i];
    }
}

/* |M^-1| x in place of x; with factors of all signs alike, which is more, where inertia does not move */
static inline void disc_mass_images(double inverse[DISC_MOVED][DISC_MOVED], const double *factor, double *x)
{
    double y[MODEL_ROOM(MODEL_NV)] = {0.0};
    for (int e = 0; !MODEL_CONSTANT_INERTIA && e < MODEL_NV; e++)
        for (int i = 0; i < MODEL_NV; i++)
            y[i] = disc_bounded(y[i] + fabs(inverse[e][i]) * x[e]);
    for (int i = 0; !MODEL_CONSTANT_INERTIA && i < MODEL_NV; i++)
        x[i] = y[i];
    for (int i = 0; MODEL_CONSTANT_INERTIA && i < MODEL_NV; i++)
        for (int c = model_mass_first[i]; c < i; c++)
            x[i] = disc_bounded(x[i] + fabs(factor[MASS_PLACE(i, c)]) * x[c]);
    for (int i = 0; MODEL_CONSTANT_INERTIA && i < MODEL_NV; i++)
        x[i] = disc_bounded(x[i] * fabs(factor[MASS_PLACE(i, i)]));
    for (int i = MODEL_NV - 1; MODEL_CONSTANT_INERTIA && i >= 0; i--)
        for (int c = model_mass_first[i]; c < i; c++)
            x[c] = disc_bounded(x[c] + fabs(factor[MASS_PLACE(i, c)]) * x[i]);
}

/* y += |dM| |x|, disc m of M */
static inline void disc_mass_product(const InertiaSeries *dM, const double *x, double *y, int m)
{
    for (int i = 0; !MODEL_CONSTANT_INERTIA && i < MODEL_NV; i++) {
        for (int c = model_mass_first[i]; c <= i; c++) {
            const double entry = (&dM[MASS_PLACE(i, c)][0])[m];
            y[i] = disc_bounded(y[i] + entry * x[c]);
            y[c] = c < i ? disc_bounded(y[c] + entry * x[i]) : y[c];
        }
    }
}

/* the discs of accelerations x, from those of their generalised forces in r, which they replace; stride: numbers from
   one series to the next */
static CALLED void disc_mass_solve(const InertiaSeries *M, const InertiaSeries *dM, const double *factor,
                                   const double *x, double *r, int stride)
{
    (void)M;
    double inverse[DISC_MOVED][DISC_MOVED];
    disc_mass_inverse(factor, inverse);
    for (int m = 0; m < DISCS; m++) {
        double size[MODEL_ROOM(MODEL_NV)];
        double base[MODEL_ROOM(MODEL_NV)];
        for (int i = 0; i < MODEL_NV; i++) {
            size[i] = fabs(x[i * stride]);
            base[i] = r[i * stride + m];
        }
        disc_mass_product(dM, size, base, m);
        disc_mass_images(inverse, factor, base);
        double ratio = 1.0;
        for (int trial = 1; ratio > 0.75 && trial <= DISC_TRIALS; trial++) {
            double change[MODEL_ROOM(MODEL_NV)] = {0.0};
            disc_mass_product(dM, base, change, m);
            disc_mass_images(inverse, factor, change);
            ratio = disc_ratio(base, change, MODEL_NV, trial < DISC_TRIALS);
        }
        disc_solution(base, ratio, MODEL_NV, r + m, stride);
    }
}

#undef MASS_PLACE
#undef DISC_MOVED
