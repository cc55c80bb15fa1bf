// Dense kernels of the multifrontal factor: BLAS and LAPACK calls in double and single precision. Matrices
// are column-major with leading dimension `stride`; triangular and symmetric kernels use lower triangles.
#pragma once

#include <cblas.h>

// LAPACK in OpenBLAS: the Cholesky factor of a dense matrix, in place.
extern "C" {
void dpotrf_(const char* triangle, const int* n, double* a, const int* stride, int* info);
void spotrf_(const char* triangle, const int* n, float* a, const int* stride, int* info);
}

namespace palpate {

inline bool factor_in_place(int n, double* a, int stride) {  // false where A is not positive definite
  int info = 0;
  dpotrf_("L", &n, a, &stride, &info);
  return info == 0;
}
inline bool factor_in_place(int n, float* a, int stride) {
  int info = 0;
  spotrf_("L", &n, a, &stride, &info);
  return info == 0;
}

// B := B L^-T
inline void solve_right(int rows, int n, const double* l, double* b, int stride) {
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows, n, 1.0, l, stride, b,
              stride);
}
inline void solve_right(int rows, int n, const float* l, float* b, int stride) {
  cblas_strsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows, n, 1.0F, l, stride, b,
              stride);
}

// C := beta C + alpha A A^T over the first `columns` columns of the lower triangle of C. C and A have the
// same number of rows.
inline void add_square(int rows, int columns, int inner, double alpha, const double* a, int stride,
                       double beta, double* c, int c_stride) {
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, columns, inner, alpha, a, stride, beta, c, c_stride);
  if (rows > columns)
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows - columns, columns, inner, alpha, a + columns,
                stride, a, stride, beta, c + columns, c_stride);
}
inline void add_square(int rows, int columns, int inner, float alpha, const float* a, int stride, float beta,
                       float* c, int c_stride) {
  cblas_ssyrk(CblasColMajor, CblasLower, CblasNoTrans, columns, inner, alpha, a, stride, beta, c, c_stride);
  if (rows > columns)
    cblas_sgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows - columns, columns, inner, alpha, a + columns,
                stride, a, stride, beta, c + columns, c_stride);
}

// X := L^-1 X, or L^-T X
inline void solve_left(CBLAS_TRANSPOSE transpose, int n, int columns, const double* l, int stride, double* x,
                       int x_stride) {
  if (columns == 1) {
    cblas_dtrsv(CblasColMajor, CblasLower, transpose, CblasNonUnit, n, l, stride, x, 1);
  } else {
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, transpose, CblasNonUnit, n, columns, 1.0, l, stride, x,
                x_stride);
  }
}
inline void solve_left(CBLAS_TRANSPOSE transpose, int n, int columns, const float* l, int stride, float* x,
                       int x_stride) {
  if (columns == 1) {
    cblas_strsv(CblasColMajor, CblasLower, transpose, CblasNonUnit, n, l, stride, x, 1);
  } else {
    cblas_strsm(CblasColMajor, CblasLeft, CblasLower, transpose, CblasNonUnit, n, columns, 1.0F, l, stride, x,
                x_stride);
  }
}

// Y := Y - A X, or Y - A^T X, with A of shape (rows, inner); X and Y share their stride.
inline void subtract_product(CBLAS_TRANSPOSE transpose, int rows, int inner, int columns, const double* a,
                             int a_stride, const double* x, double* y, int stride) {
  if (columns == 1) {
    cblas_dgemv(CblasColMajor, transpose, rows, inner, -1.0, a, a_stride, x, 1, 1.0, y, 1);
  } else {
    const bool plain = transpose == CblasNoTrans;
    cblas_dgemm(CblasColMajor, transpose, CblasNoTrans, plain ? rows : inner, columns, plain ? inner : rows,
                -1.0, a, a_stride, x, stride, 1.0, y, stride);
  }
}
inline void subtract_product(CBLAS_TRANSPOSE transpose, int rows, int inner, int columns, const float* a,
                             int a_stride, const float* x, float* y, int stride) {
  if (columns == 1) {
    cblas_sgemv(CblasColMajor, transpose, rows, inner, -1.0F, a, a_stride, x, 1, 1.0F, y, 1);
  } else {
    const bool plain = transpose == CblasNoTrans;
    cblas_sgemm(CblasColMajor, transpose, CblasNoTrans, plain ? rows : inner, columns, plain ? inner : rows,
                -1.0F, a, a_stride, x, stride, 1.0F, y, stride);
  }
}

}  // namespace palpate
