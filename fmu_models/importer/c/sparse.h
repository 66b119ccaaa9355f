/* Factors of a I - J for a sparse J, real or complex: columns in the order of a pattern, rows exchanged. */
#pragma once

#include "pattern.h"

#include <stddef.h>

/* the columns of a triangle */
typedef struct {
    int64_t *start, room;
    int *row;
    void *value;
} Triangle;

typedef struct {
    int n;
    const int *order;      /* of the columns */
    Triangle lower, upper; /* ones of the diagonal left out; diagonal last in a column */
    int *step;             /* (n): at which a row was the pivot */
    int *path, *mark;      /* (n) */
    int64_t *next;         /* (n) */
    void *column;          /* (n) */
} Factors;

int sparse_new(Factors *f, int n, const int *order, size_t number); /* 0 where there is no room; number: its bytes */
void sparse_free(Factors *f);
/* 0 if it is singular, or there is no room */
int sparse_real_factor(Factors *f, const Pattern *p, const double *jacobian, double shift);
int sparse_complex_factor(Factors *f, const Pattern *p, const double *jacobian, double complex shift);
/* b becomes the solution */
void sparse_real_solve(const Factors *f, double *b);
void sparse_complex_solve(const Factors *f, double complex *b);
