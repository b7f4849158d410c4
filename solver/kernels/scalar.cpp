// SPDX-License-Identifier: MIT
#include <cmath>

#include "solver/kernels/pair_loop.h"

namespace holdfast::kernels {
namespace {

// One lane, plain arithmetic: the reference in the tests of the others.
template <typename T>
struct ScalarLanes {
  using Real = T;
  using Vector = T;
  static constexpr int kWidth = 1;
  static T Zero() { return 0; }
  static T Set(T v) { return v; }
  static T Load(const T* p) { return *p; }
  static void Store(T* p, T v) { *p = v; }
  static T Add(T a, T b) { return a + b; }
  static T Sub(T a, T b) { return a - b; }
  static T Mul(T a, T b) { return a * b; }
  static T MulAdd(T a, T b, T c) { return a * b + c; }
  static double Sum(T v) { return static_cast<double>(v); }
  static void SumTen(const T (&v)[10], double* out) { SumEach<ScalarLanes>(v, out); }
  static void SqrtAndInverse(T d2, T& distance, T& inverse) {
    distance = std::sqrt(d2);
    inverse = T(1) / distance;
  }
};

}  // namespace

void PairLoopScalar(const PairArguments<float>& in) { PairLoop<ScalarLanes<float>>(in); }
void PairLoopScalar(const PairArguments<double>& in) { PairLoop<ScalarLanes<double>>(in); }
void RankUpdateScalar(const double* rows, int num_rows, int width, double* product) {
  RankUpdateLoop<ScalarLanes<double>>(rows, num_rows, width, product);
}

}  // namespace holdfast::kernels
